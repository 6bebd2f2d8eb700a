"""Packages for machine controllers: the C kernels of an arm with glue between them and the controller's interface.

In: a robot's kernels and the C files that were printed and proved for it. Out: `{path: text}` of a folder that is built
where the controller is, the C files byte for byte among them. The glue is printed from `templates/controllers/`, one
folder for each controller; `templates/controllers/_follow.*` is what all of them share: the inverse of the step after
this one.

    controller  the controllers, as `--package` names them
    machine     what a controller has to know of an arm, or why it cannot have that arm
    home        joint values away from singularities, at which an example begins
    follow      the numbers of the inverse that follows a path
    context     what the templates are given
    project     the folder as text
"""
