"""What the owner of a machine believes of it: case.json of a bundle, checked.

    format1     Case of the three machines that exchange format 1 knows by name
    parts       its sensors, drive and tolerances
    laws        laws that a case may say, and the controller of format 1
    config_law  the law by the config of our own recordings; unsaid: parts that no simulation computes
    quantities  units and nouns of an axis
    format2     reader of a described machine, exchange format 2
    graph_case  its GraphCase: numbers by dotted path, with tolerances
    controller  its law, with the sensor and the drive of the loop
    paths       tolerances and per_recording, which name numbers by dotted path
    known       terms of physics and measured inputs that the owner knows
    start       first states, which each recording has for itself
    checks      numbers, objects, unknown keys
    load        a case of either format

A case knows no recording: what is read of columns stands in rtctl/trace and rtctl/diagnose.
"""
