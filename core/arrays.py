"""Shapes of the arrays that core passes around."""

import numpy as np

Vector = np.ndarray[tuple[int], np.dtype[np.float64]]
Matrix = np.ndarray[tuple[int, int], np.dtype[np.float64]]
Tensor = np.ndarray[tuple[int, int, int], np.dtype[np.float64]]
ComplexVector = np.ndarray[tuple[int], np.dtype[np.complex128]]
ComplexMatrix = np.ndarray[tuple[int, int], np.dtype[np.complex128]]
ComplexTensor = np.ndarray[tuple[int, int, int], np.dtype[np.complex128]]
Indices = np.ndarray[tuple[int], np.dtype[np.intp]]
Mask = np.ndarray[tuple[int], np.dtype[np.bool_]]
