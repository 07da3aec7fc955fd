"""IPOPT's set-up in all measurements."""

#: What made IPOPT quickest here: warm starts from both solution and multipliers, the barrier
#: parameter chosen by itself (8 iterations a solve instead of 11), expressions written out.
OPTIONS = {
    "expand": True,
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 2000,
    "ipopt.bound_relax_factor": 0.0,  # else constraints are violated by 1e-8
}
WARM_START = {
    "ipopt.mu_strategy": "adaptive",
    "ipopt.warm_start_init_point": "yes",
    "ipopt.warm_start_bound_push": 1e-8,
    "ipopt.warm_start_mult_bound_push": 1e-8,
    "ipopt.warm_start_slack_bound_push": 1e-8,
}
