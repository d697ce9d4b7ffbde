// Empty: its target holds the precompiled header of all test programs.
