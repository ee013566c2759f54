"""One physical effect a file: its equation, force, energy and loss. No field is touched here.

The functions work on lanes: a scalar of the physics is a vector of W contacts, a 3-vector is a
`kernels.lanes` struct of three of them. Those made of arithmetic alone are plain Python as well
(NumPy in, NumPy out), so that tests and analysis use the very same source.
"""
