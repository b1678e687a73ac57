"""Nominal model of a machine: case.json of a bundle, checked.

    format1     Case of the three machines that exchange format 1 knows by name
    parts       its sensors, drive and tolerances
    laws        laws that a case may name, and the controller of format 1
    config_law  the law in the config of recordings by rtctl; unsaid: parts that no simulation computes
    quantities  units and nouns of an axis
    format2     reader of a described machine, exchange format 2
    graph_case  its GraphCase: numbers by dotted path, with tolerances
    controller  its law, with the sensor and the drive of the loop
    paths       tolerances and per_recording, which name numbers by dotted path
    known       known terms of physics and measured inputs
    start       initial states, which differ between recordings
    checks      numbers, objects, unknown keys
    load        a case of either format

A case holds no recording: rtctl/trace and rtctl/diagnose read the columns.
"""
