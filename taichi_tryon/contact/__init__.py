"""What the cloth meets: contact and friction as potentials and return maps, knowing no garment and no solver."""
