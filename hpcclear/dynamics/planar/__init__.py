"""A scene's linkage: from its tables to the mechanism as data, and from there to what the kernel and the datasets take."""
