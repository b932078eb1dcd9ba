"""Benchmarks: cases that race simulations against each other and against other programs.

A case is a file with a function ``case`` (:mod:`.case` says what it returns), whose arguments are
options of ``bench --set``. Those of the project lie in ``tests/benchmarks`` of a checkout: the
cases, the work that they share in ``work/``, and other programs in ``peers/``. Copy one to add
another; this is a whole one::

    '''A cube of springs, both precisions.'''

    import particlesim as ps
    from particlesim.accuracy.bench.case import Case, Entry, Simulated
    from particlesim.scenes import spring_lattice


    def ours(precision, frames):
        def start(place):
            settings = ps.Settings(dt=1 / 60, precision=precision, threads=place.threads)
            sim = ps.Simulation(spring_lattice.build(), settings, device=place.device)
            return Simulated(sim, frames, lambda sim: {"energy": sim.diagnostics().energy[0]})

        return Entry(start, precision)


    def case(frames=10):
        return Case(
            title=f"a cube of springs, {frames} frames a block",
            unit="particle-substeps",
            ours={each: ours(each, frames) for each in ("float32", "float64")},
            agree={"energy": 1e-3},
        )
"""
