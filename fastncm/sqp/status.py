"""What a solve can end with: a number in compiled code, a word and a sentence of advice outside."""

CONVERGED, NO_CONTACT, MAX_ITERATIONS, INFEASIBLE, NO_EQUILIBRIUM, NUMERICAL_ERROR = range(6)
#: More reasons, each with the word of its kind.
SPREAD_CONTACT, THROUGH_CLAMP, TOO_COARSE, BRANCH_ENDS = 6, 7, 8, 9

#: Word for each status number, as it stands in the tables.
WORDS = (
    "converged",
    "no_contact",
    "max_iterations",
    "infeasible",
    "no_equilibrium",
    "numerical_error",
    "no_equilibrium",
    "infeasible",
    "max_iterations",
    "no_equilibrium",
)

#: What the engineer can do about it, for each status number.
ADVICE = (
    "",
    "The target does not touch the finger here; the force is zero.",
    "The solver found no solution from the last position's shape: use more positions (path.steps), "
    "so that each starts closer to the last, or a higher solver.order.",
    "The finger cannot get out of the target's way here: check jaw, target and path for an overlap "
    "that bending cannot clear.",
    "There is no equilibrium here: friction locks (friction.mu is too high for this geometry), or "
    "the path has passed a limit point.",
    "The arithmetic broke down here (overflow or a singular system): check for extreme ratios of "
    "lengths or stiffnesses in the scene.",
    "The paper's friction rule (14)-(17) has one moment equation and needs a single contact point; "
    "here several points touch: use friction.model = 'equilibrium'.",
    "The target's way here leads through the finger's clamp, from where no finger gets out of its "
    "way: check target and path.",
    "The nodes are too far apart for the contact, which is next to the clamp or sharper than an "
    "interval: use a larger solver.intervals.",
    "No equilibrium is found on the way here: the target was moved on in ever smaller steps, and "
    "beyond some place none had any. The finger slips off, snaps to where its other side touches, "
    "or, with friction, locks; if solver.intervals is small, try a larger one.",
)


def end_of_branch(number: int, rubs: bool, position: float, mu: float, energy: float) -> str:
    """Advice for the status `number` where the branch of equilibria from first touch ends: whether
    there is friction, the target's position (m) there, the critical friction (NaN: unknown), and
    the energy (J) that a snap releases (NaN: there is no snap)."""
    if number == INFEASIBLE:
        return f"{ADVICE[INFEASIBLE]} So it is beyond {position:.9g} m."
    if energy == energy:
        said = (
            f"The path passes a limit point at {position:.9g} m: the finger snaps from there and "
            f"releases {energy:.4g} J; what follows is not on the branch from first touch."
        )
        if number == MAX_ITERATIONS:
            said += f" {ADVICE[MAX_ITERATIONS]}"
    elif not rubs:
        said = (
            f"The branch of stable shapes from first touch ends at {position:.9g} m, and no shape "
            "is found that the finger snaps to: the target may push it over there, or get round "
            "the jaw's corner b to where the jaw has no surface. Stop the path before (path.stop), "
            "or change jaw, target or path.y so that the target's corner or side does not get "
            "caught; if the end of the finger is thin, a higher solver.order tells whether the "
            "branch really ends."
        )
    else:
        said = (
            f"No equilibrium on the branch from first touch is found beyond {position:.9g} m: "
            "friction locks (friction.mu is too high for this geometry), or the branch ends there."
        )
    if mu == mu:
        said += f" The finger slides on to the next position with friction.mu up to {mu:.7f}."
    return said
