"""Finds the physics that a simulation lacks: from a recording and the owner's model to names, nodes and sizes.

`chain` is the whole of it, stage by stage. What the other files are for:

    the recording     record, columns, case, quantities (units, nouns)
                      rest (rows that tell something), scales, stretches, tacho
    its law           law (the compiled step), law_params, config_law (of our own recordings), unsaid (not in it)
                      replayed (the recording's tick on its readings), emulate (the tick with a model as its plant)
    the simulation    model, kernel, simulate; solver (is it to be trusted?), measure (how far is it off?)
    the errors        problem (what they weigh), white (the same, made white), edges, jitter, hiss
    a fit             space (what may move), fit
    the stages        preflight, base (the owner's parameters), hints, find, verdict, predict, locate, stands
    what is asked     hypotheses, yardstick (sizes to begin with), forms (richer ones), scan (closer looks), turn
    the search        screen, name (grows models), rework, rivals, rubbing, beyond, faint
    the judgement     decide, chances, anylaw, plausible; uncertainty (intervals), heldout and release (prediction)
    the answer        diagnosis, words, numbers, figures, report, missing
                      shrink (to what predicts), export and carry (as a config)
    what comes next   experiment, motions, ordinary, plan, played (which one to run)
                      repair (record, diagnose, run it, again)
    many, concealed   folder, results; conceal, seal
    described         engines (which one), graph (machines of bodies and joints: a package of its own)
"""
