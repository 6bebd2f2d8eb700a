"""The viewer: a robot as one HTML page that needs no network.

In: a `Robot`. Out: the text of a page with the arm, its controls, and kernels that `emit/javascript` prints.

    options      what a page is made of
    kernels      the programs, as JavaScript that the page contains
    expressions  exact expressions as JSON
    data         the robot as JSON
    checks       test vectors, with which the page checks its kernels
    rows         the tables of every convention, for the panel of the table
    mathml       formulas as lists, of which the page makes elements
    printed      the closed form as JSON that the page evaluates
    formula      the closed form with all that has a value
    solve        what the page has to know to solve for joints
    cloud        points that the tip reaches
    panels       the data and scripts of the panels together
    document     the page
"""
