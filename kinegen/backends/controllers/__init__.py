"""Packages for machine controllers: the C kernels of an arm with glue between them and the controller's interface.

In: a robot's kernels and the C files that were printed and proved for it. Out: `{path: text}` of a folder that is built
where the controller is, the C files byte for byte among them. The glue is printed from `templates/controllers/`, one
folder for each controller; `templates/controllers/_follow.*` is what all of them share: the inverse of the step after
this one.

    controller    the controllers, as `--package` names them, and the names that they have taken
    machine       what a controller has to know of an arm, or why it cannot have that arm
    kernel_calls  what the glue calls of the kernels, the inverse that follows a path among it
    context       what the templates are given besides the robot and the names of its kernels
    project       the folder as text
"""
