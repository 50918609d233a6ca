"""Graph operators on garment meshes: convolution, pooling, and the network made of them."""
