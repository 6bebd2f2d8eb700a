"""The viewer: a robot as one HTML page that needs no network.

In: a `Robot`. Out: the text of a page with the arm, its controls, and kernels that `backends/javascript` prints.

    data              the robot as JSON, and its exact expressions
    closed_form_json  the closed form as JSON that the page evaluates, and formulas as lists
    panels            tables of every convention, closed form, inverse and singular places
    document          the page, with kernels, their test vectors, and the points that the tip reaches
"""
