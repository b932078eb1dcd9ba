"""Faults that still go by in silence, by name of the row, with what is to catch them."""

WATCHED = "energy and its trend are not watched"
AHEAD = "limits do not look along the path ahead"
TURNING = "a kick by what turns with the velocity is explicit"
UNMET = "constraints that are not met are not told"
TIMED = "limits do not look at laws of time"

PENDING = {
    "spring, omega dt = 1.99, Euler": WATCHED,
    **{
        f"magnetic field, omega h = {phase}, {method}": TURNING
        for phase in (0.02, 0.1, 0.5)
        for method in ("Euler", "Verlet")
    },
    "Coriolis, 2 omega h = 0.2": TURNING,
    **{f"atoms at rest at 1.3, step {dt}": AHEAD for dt in (0.1, 0.3)},
    **{f"Morse, at rest at 1.8, step {dt}": AHEAD for dt in (0.3, 1.0)},
    **{f"attracting Yukawa, {method}": AHEAD for method in ("Euler", "Verlet")},
    "comet of e = 0.9 by a law": AHEAD,
    "opposite charges that fall together": AHEAD,
    **{f"a free flight into a wall, omega dt = {phase}": AHEAD for phase in (1.9, 3.0)},
    "a chain with one stiff spring at 0.998 of its limit": WATCHED,
    **{f"a pulse of {length} s": TIMED for length in (1e-05, 0.001)},
    "a push along the velocity": TURNING,
    **{
        f"10 rigid links under {ratio} times their mass": UNMET
        for ratio in ("100", "1000", "10000", "1e+06")
    },
    "200 rigid links": UNMET,
    "a column of 60 grains": UNMET,
    "a heavy ball on light ones": UNMET,
    "a rod between two pins of another distance": UNMET,
    "a ball in a gap narrower than itself": UNMET,
    "a box full beyond what fits": UNMET,
    "a square whose gradient vanishes": UNMET,
    "a soft rope damped by 1000": UNMET,
    "a soft rope damped by 1e+06": UNMET,
    "a bullet that passes a ball later on": AHEAD,
    # Steps that are chosen automatically.
    **{
        f"{scene}, {way} automatic{more}": why
        for scene, why, ways in (
            ("atoms at rest at 1.3, Euler", AHEAD, ("substeps",)),
            ("Morse, at rest at 1.8, Euler", AHEAD, ("substeps",)),
            ("Morse, at rest at 1.8, Verlet", AHEAD, ("substeps",)),
            ("attracting Yukawa, Euler", AHEAD, ("substeps",)),
            ("attracting Yukawa, Verlet", AHEAD, ("substeps",)),
            ("a comet of e = 0.6, Euler", AHEAD, ("dt 1", "dt 10")),
            ("a comet of e = 0.6, Verlet", AHEAD, ("dt 1", "dt 10")),
            ("a comet of e = 0.95, Euler", AHEAD, ("substeps", "dt 1", "dt 10")),
            ("a comet of e = 0.95, Verlet", AHEAD, ("substeps", "dt 1", "dt 10")),
            ("a comet of e = 0.9 by a law, Euler", AHEAD, ("substeps", "dt 1", "dt 10")),
            ("a comet of e = 0.9 by a law, Verlet", AHEAD, ("substeps", "dt 1")),
            ("a magnetic field, Euler", TURNING, ("substeps", "dt 1")),
            ("a magnetic field, Verlet", TURNING, ("substeps", "dt 1")),
        )
        for each in ways
        for way, more in [(each.split()[0], f", {each.split()[1]} substeps" if " " in each else "")]
    },
}
