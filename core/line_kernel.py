"""Misfit of a superstructure to the spectral lines of a record, with all that calibration needs, compiled.

At every line the channels are z = h a_b + R θ + B v + t + noise: the base slab's acceleration a_b, free; its rocking θ and
accelerations v that act at single floors, random with variances by frequency band; t the free vibration left by the
record's ends. h, R and B are the structure's responses. The variance of all but a_b is V, and with
P = V⁻¹ - V⁻¹ h (hᴴ V⁻¹ h)⁻¹ hᴴ V⁻¹ the misfit is Σ zᴴ P z (errors in variables: Pintelon and Schoukens 2012, chapter 8).
"""

import numba
import numpy as np


@numba.njit(cache=True)
def inverted(V, inverse):  # type: ignore[no-untyped-def]  # numba gives no types
    """Writes the inverse of a small Hermitian positive matrix, by Gauss and Jordan; returns the log determinant."""
    size = V.shape[0]
    logdet = 0.0
    for i in range(size):
        for j in range(size):
            inverse[i, j] = V[i, j]
    for k in range(size):
        pivot = inverse[k, k].real
        logdet += np.log(pivot)
        inverse[k, k] = 1.0
        for j in range(size):
            inverse[k, j] /= pivot
        for i in range(size):
            if i != k:
                factor = inverse[i, k]
                inverse[i, k] = 0.0
                for j in range(size):
                    inverse[i, j] -= factor * inverse[k, j]
    return logdet


@numba.njit(cache=True)
def evaluated(  # type: ignore[no-untyped-def]  # numba gives no types
    angular, z, noise, band, rocking_variance, floor_variance, local, dynamic_share,
    squared, shapes, measured, inputs, derivatives, damping, mass, height, gain, delay,
    transient, transient_by, vibration, frozen, is_random, is_free,
):  # fmt: skip
    """Sums over the lines.

    Args (n floors, m modes, F measured floors, C = 1 + F channels, K structural parameters, L lines):
        angular: (L,) rad/s. z: (C, L) spectra. noise: (C,) power. band: (L,) index.
        rocking_variance, floor_variance: (bands,). local: (C, C) variance of a motion that is seen at sensors alone.
        dynamic_share: of floor_variance that acts through the structure; the rest is local.
        squared, shapes, inputs, derivatives, damping, mass: of core.superstructure_model.Superstructure.
        measured: (F,). height: (n,). gain: (C,) logarithms. delay: (C,) s.
        transient: (F, L). transient_by: (K, F, L) its derivatives. vibration: (2 m, F, L); all three may have L = 0.
        frozen: (L, C) h at which the variance's determinant is taken. is_random: whether any variance may be above zero.
        is_free: (size,) the parameters whose derivatives are wanted; if none is, only the misfit is found.

    Returns:
        misfit, log determinant, (size,) descent direction of their sum, (size, size) Gauss-Newton matrix,
        (bands, 5) numerators and denominators of both variances' steps and the misfit, (L, C) h.
    """
    lines, channels, floors, modes = angular.size, z.shape[0], shapes.shape[0], squared.size
    stiff = derivatives.shape[0]
    first_mass, first_damping = 1 + floors, 3 + 2 * floors
    structural = first_damping + 3
    size = structural + 2 * channels + vibration.shape[0]
    descent, normal = np.zeros(size), np.zeros((size, size))
    steps = np.zeros((rocking_variance.size, 5))
    chosen = np.flatnonzero(is_free)
    h_all = np.empty((lines, channels), np.complex128)
    V, Vi = np.zeros((channels, channels), np.complex128), np.zeros((channels, channels), np.complex128)
    h, R, VH = np.zeros(channels, np.complex128), np.zeros(channels, np.complex128), np.zeros(channels, np.complex128)
    B = np.zeros((channels, floors), np.complex128)
    Q, residual, Pz = (
        np.zeros(channels, np.complex128),
        np.zeros(channels, np.complex128),
        np.zeros(channels, np.complex128),
    )
    P = np.zeros((channels, channels), np.complex128)
    compliance, coordinate = np.zeros(modes, np.complex128), np.zeros(modes, np.complex128)
    v, y = np.zeros(floors, np.complex128), np.zeros(modes, np.complex128)
    J, PJ = np.zeros((size, channels), np.complex128), np.zeros(channels, np.complex128)
    through = np.zeros((modes, modes), np.complex128)
    back = np.zeros(modes, np.complex128)
    has_transient = transient.shape[1] > 0
    total_mass = mass.sum()
    logdet = 0.0
    for l in range(lines):
        w = angular[l]
        stiffening = 1.0 + 1j * (w * damping[0] + damping[1])
        for r in range(modes):
            compliance[r] = 1.0 / (squared[r] * stiffening - w * w + 1j * w * damping[2])
        # responses at the channels
        for c in range(channels):
            Q[c] = np.exp(gain[c] - 1j * w * delay[c])
            residual[c] = z[c, l]
        h[0] = Q[0]
        R[0] = 0.0
        for f in range(channels - 1):
            row = measured[f]
            a, b = 1.0 + 0j, height[row] + 0j
            for r in range(modes):
                s = w * w * shapes[row, r] * compliance[r]
                a += s * inputs[r, 0]
                b += s * inputs[r, 1]
            h[f + 1] = Q[f + 1] * a
            R[f + 1] = Q[f + 1] * b
            if has_transient:
                residual[f + 1] -= Q[f + 1] * transient[f, l]
        variance_r, variance_f = rocking_variance[band[l]], floor_variance[band[l]]
        if is_random:
            for f in range(channels - 1):
                row = measured[f]
                for i in range(floors):
                    a = 0j
                    for r in range(modes):
                        a += shapes[row, r] * compliance[r] * inputs[r, 2 + i]
                    B[f + 1, i] = Q[f + 1] * w * w * a
            for i in range(channels):
                for j in range(channels):
                    a = 0j
                    for k in range(floors):
                        a += B[i, k] * B[j, k].conjugate()
                    a = variance_f * (dynamic_share * a + (1 - dynamic_share) * local[i, j])
                    V[i, j] = a + variance_r * R[i] * R[j].conjugate()
                V[i, i] += noise[i]
            logdet += inverted(V, Vi)
        else:
            for i in range(channels):
                Vi[i, i] = 1.0 / noise[i]
        # projection on what the base slab's motion cannot explain
        hh, amplitude = 0.0, 0j
        for i in range(channels):
            a = 0j
            for j in range(channels):
                a += Vi[i, j] * h[j]
            VH[i] = a
            hh += (h[i].conjugate() * a).real
            h_all[l, i] = h[i]
        for i in range(channels):
            amplitude += VH[i].conjugate() * residual[i] / hh
        if is_random:
            a = 0.0
            for i in range(channels):
                for j in range(channels):
                    a += (frozen[l, i].conjugate() * Vi[i, j] * frozen[l, j]).real
            logdet += np.log(a)
        rocking = 0j
        for i in range(channels):
            a = -VH[i] * amplitude
            for j in range(channels):
                a += Vi[i, j] * residual[j]
                P[i, j] = Vi[i, j] - VH[i] * VH[j].conjugate() / hh
            Pz[i] = a
            steps[band[l], 4] += (residual[i].conjugate() * a).real
            rocking += R[i].conjugate() * a
        if is_random:
            steps[band[l], 0] += rocking.real**2 + rocking.imag**2
            for i in range(channels):
                for j in range(channels):
                    a = 0j
                    for k in range(floors):
                        a += B[i, k] * B[j, k].conjugate()
                    a = dynamic_share * a + (1 - dynamic_share) * local[i, j]
                    steps[band[l], 1] += (R[i].conjugate() * P[i, j] * R[j]).real
                    steps[band[l], 2] += (Pz[i].conjugate() * a * Pz[j]).real
                    steps[band[l], 3] += (P[i, j] * a.conjugate()).real
        if chosen.size == 0:
            continue
        rocking *= variance_r
        for k in range(floors):
            a = 0j
            if is_random:
                for i in range(channels):
                    a += B[i, k].conjugate() * Pz[i]
            v[k] = dynamic_share * variance_f * a
        for r in range(modes):
            a = inputs[r, 0] * amplitude + inputs[r, 1] * rocking
            for k in range(floors):
                a += inputs[r, 2 + k] * v[k]
            coordinate[r] = w * w * a * compliance[r]
        # derivatives of the channels
        J[:] = 0.0
        for k in range(stiff):
            place = k if k < 1 + floors else k + floors
            if not is_free[place]:
                continue
            for r in range(modes):
                a = 0j
                for s in range(modes):
                    a += derivatives[k, r, s] * coordinate[s]
                y[r] = -stiffening * compliance[r] * a
            for f in range(channels - 1):
                a = 0j
                for r in range(modes):
                    a += shapes[measured[f], r] * y[r]
                J[place, f + 1] = Q[f + 1] * a
        for i in range(floors if is_free[first_mass] else 0):
            moved = 0j
            for r in range(modes):
                moved += shapes[i, r] * coordinate[r]
            a = mass[i] * (w * w * (amplitude + height[i] * rocking + v[i] + moved) - 1j * w * damping[2] * moved)
            for f in range(channels - 1):
                b = 0j
                for r in range(modes):
                    b += shapes[measured[f], r] * shapes[i, r] * compliance[r]
                J[first_mass + i, f + 1] = Q[f + 1] * a * b
        for f in range(1, channels):
            a = 0j
            for i in range(floors):
                a += J[first_mass + i, f]
            for i in range(floors):
                J[first_mass + i, f] -= mass[i] / total_mass * a
        for f in range(channels - 1):
            for r in range(modes):
                a = -Q[f + 1] * shapes[measured[f], r] * coordinate[r] * compliance[r]
                J[first_damping, f + 1] += a * squared[r] * 1j * w * damping[0]
                J[first_damping + 1, f + 1] += a * squared[r] * 1j * damping[1]
                J[first_damping + 2, f + 1] += a * 1j * w * damping[2]
        for c in range(channels):
            a = h[c] * amplitude + R[c] * rocking
            for k in range(floors):
                a += B[c, k] * v[k]
            if has_transient and c > 0:
                a += Q[c] * transient[c - 1, l]
            J[structural + c, c] = a
            J[structural + channels + c, c] = -1j * w * a
        if has_transient:
            for f in range(channels - 1):
                for k in range(structural):
                    J[k, f + 1] += Q[f + 1] * transient_by[k, f, l]
                for k in range(vibration.shape[0]):
                    J[structural + 2 * channels + k, f + 1] = Q[f + 1] * vibration[k, f, l]
        # sums
        for n in range(chosen.size):
            k = chosen[n]
            for i in range(channels):
                a = 0j
                for j in range(channels):
                    a += P[i, j] * J[k, j]
                PJ[i] = a
                descent[k] += 2 * (J[k, i].conjugate() * Pz[i]).real
            for m in chosen[: n + 1]:
                a = 0.0
                for i in range(channels):
                    a += J[m, i].real * PJ[i].real + J[m, i].imag * PJ[i].imag
                normal[k, m] += 2 * a
        if is_random:
            _determinant_descent(
                descent, through, back, w, stiffening, compliance, inputs, derivatives, damping, squared, shapes, measured,
                Q, R, B, P, variance_r, dynamic_share * variance_f, first_damping, floors,
            )  # fmt: skip
    for k in range(size):
        for m in range(k):
            normal[m, k] = normal[k, m]
    return steps[:, 4].sum(), logdet, descent, normal, steps, h_all


@numba.njit(cache=True)
def _determinant_descent(  # type: ignore[no-untyped-def]  # numba gives no types
    descent, through, back, w, stiffening, compliance, inputs, derivatives, damping, squared, shapes, measured,
    Q, R, B, P, rocking_variance, floor_variance, first_damping, floors,
):  # fmt: skip
    """Takes from the descent direction what the variance's determinant grows by: 2 Re Σ Sᵢ Bᵢᴴ P dBᵢ at one line."""
    modes, channels = squared.size, Q.size
    through[:] = 0.0
    for i in range(floors + 1):
        variance = floor_variance if i < floors else rocking_variance
        for r in range(modes):
            back[r] = 0.0
        for f in range(1, channels):
            a = 0j
            for c in range(channels):
                a += (B[c, i] if i < floors else R[c]).conjugate() * P[c, f]
            for r in range(modes):
                back[r] += a * Q[f] * shapes[measured[f - 1], r] * compliance[r]
        for s in range(modes):
            a = variance * w * w * inputs[s, 2 + i if i < floors else 1] * compliance[s]
            for r in range(modes):
                through[s, r] += a * back[r]
    for k in range(derivatives.shape[0]):
        a = 0j
        for r in range(modes):
            for s in range(modes):
                a += derivatives[k, r, s] * through[s, r]
        descent[k if k < 1 + floors else k + floors] += 2 * (stiffening * a).real
    for r in range(modes):
        a = 2j * through[r, r]
        descent[first_damping] += (a * squared[r] * w * damping[0]).real
        descent[first_damping + 1] += (a * squared[r] * damping[1]).real
        descent[first_damping + 2] += (a * w * damping[2]).real
