"""A rigid body guided in space by points on surfaces and curves (Mangeron, Oğuztöreli and Plitea 1970)."""
