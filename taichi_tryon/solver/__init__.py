"""The implicit step: matrix, linear solver, Newton, step control. It knows particles and laws, no garment."""
