"""Pictures of body and garments: one description of the scene, drawn by GGUI or, without Vulkan, by a rasteriser."""
