"""Goals of figures over flights; every folder is a set with its flights and goals."""
