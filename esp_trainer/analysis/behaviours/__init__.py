"""Detectors of the behaviours that the paper names in sections VI and VII, defined on the torus.

The paper's authors saw these behaviours in videos and did not define them. Here each is defined by a rule that reads
the agents' paths, never their networks; the rule is compiled for Python and translated for the page of a report. Its
rate is reported beside the rate in episodes made of the same paths in which agents do not react to each other
(:mod:`.null`).
"""
