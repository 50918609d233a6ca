"""The graph Laplacian of a mesh, scaled for Chebyshev polynomials."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array


def scaled_laplacian(faces: NDArray[np.integer], count: int) -> csr_array:
    """L' = 2 L / lambda_max - I of the symmetric Laplacian L = I - D^-1/2 A D^-1/2, with lambda_max = 2, its
    upper bound: L' = -D^-1/2 A D^-1/2, (V, V), with eigenvalues in [-1, 1].

    A is 1 where an edge is; D its row sums; faces (F, 3) over V = count vertices.
    Source: Defferrard, Bresson, Vandergheynst 2016, "Convolutional neural networks on graphs with fast
    localized spectral filtering", section 2.1; the bound as in `torch_geometric.nn.ChebConv`.
    """
    adjacency = csr_array(igl.adjacency_matrix(np.ascontiguousarray(faces, dtype=np.int64)))
    adjacency.resize((count, count))
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    root = diags_array(1.0 / np.sqrt(np.maximum(degree, 1.0)))
    return csr_array(-(root @ adjacency @ root)).astype(np.float32)
