"""One physical effect a file: its equation, force, energy and loss. Fields are not used here.

The functions work on lanes: a scalar of the physics is a vector of W contacts, a 3-vector is a
`kernels.lanes` struct of three of them. Functions of arithmetic alone are plain Python as well
(NumPy in, NumPy out), so that tests and analysis use the same source.
"""
