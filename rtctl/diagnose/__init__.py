"""Finds the physics that a simulation lacks: from a recording and the owner's model to names, nodes and sizes.

Any machine that is bodies and joints is diagnosed by what is in `graph`. What the files beside it are for:

    any machine       graph
    the recording     record, columns, edges, tacho,
                      hold (commands between samples)
    its law           law (the compiled step), law_params
                      replayed (the recording's tick on its readings)
    the simulation    model, comparison (how far is it off?)
    a fit             space (what may move), fit
    what is asked     hints, forms (richer ones), turn
    the answer        diagnosis, words, numbers, figures, report, missing
                      export and carry (as a config), results (its files)
    what comes next   motions, ordinary, plan, played (which one to run)
                      repair (record, diagnose, run it, again)
    many, concealed   bundles, folder; conceal, seal
"""
