"""A material of the continuum from grain runs (`dust fit continuum`).

What a grain run shows (`observations`) is compared with what a material point shows that is
strained in the same way (`model`), for all numbers of the material at once (`fitting`); what comes
out is a block of YAML that says where each number comes from (`writing`).
"""
