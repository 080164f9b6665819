"""The laws of cloth: what it stores and how it pushes back, knowing no time step."""
