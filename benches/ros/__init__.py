"""Round trips through the node, over real transports and between real processes."""
