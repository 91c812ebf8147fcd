"""The behaviours that the paper names in sections VI and VII, defined on the toroid, and counted.

The paper saw them in videos and defines none. Here each is a rule that reads what agents did, never their networks, and
it is reported beside the rate that the same motions give where nobody reacts to anybody (:mod:`.null`).
"""
