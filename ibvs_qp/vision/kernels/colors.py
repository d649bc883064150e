"""What samples of the surface tell of its colour, of the light on it, and of the paint.

Colours are RGB in grey levels; an empty one stands for an unknown one.
"""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import kernel
from ibvs_qp.vision.kernels.labels import known, squared_distance
from ibvs_qp.vision.kernels.median import upper_median

#: Share of the gate within which a colour is the surface's however coarse its label: labels are in steps of 8.
SURE = 0.75
#: Light that differs by less than this over the surface is even [ln]: the gate holds +-0.1 on a white board.
UNEVEN = 0.10
#: Light of samples in which board or paint could be at all, times that in which their colour is known.
_DIMMEST, _BRIGHTEST = np.float32(0.4), np.float32(2.5)
#: Distance from the board's and from the paint's tint, share of the gate in that light: a mixed edge is farther.
_BOARD_TINT, _PAINT_TINT = 0.7, 0.6
#: A channel this high is cut off, it tells neither light nor tint; and the highest there is.
_CUT, _WHITE = 250, np.float32(255.0)
#: Samples of the board whose median is taken, up to twice as many; more cost time and change nothing.
_JUDGED = 500


@kernel("Tuple((i8, f4[::1]))(u1[:, ::1], b1[::1], f4[::1], f4[::1], f8)")
def board_color(
    colors: np.ndarray, component: np.ndarray, paint: np.ndarray, board: np.ndarray, gate: float
) -> tuple[int, np.ndarray]:
    """Upper median of the surface's samples that show the board: not the paint and, if it is known, like the board.

    Args:
        colors: Samples, (n, 3).
        component: Which of them are on the surface, (n,).
        paint: Colour of the paint, (3,).
        board: Colour of the board so far, (3,); if few samples are like it, none show it.
        gate: Distance within which a colour matches.

    Returns:
        How many show it, and their median (3,), zero without any.
    """
    unpainted, like = np.empty(len(colors), np.int64), np.empty(len(colors), np.int64)
    gate_squared, count, near = np.float32(gate * gate), 0, 0
    paint_color, board_before = known(paint), known(board)
    for k in range(len(colors)):
        if not component[k]:
            continue
        red, green, blue = np.float32(colors[k, 0]), np.float32(colors[k, 1]), np.float32(colors[k, 2])
        if not squared_distance(red, green, blue, paint_color) > gate_squared:
            continue
        unpainted[count] = k
        count += 1
        if squared_distance(red, green, blue, board_before) < gate_squared:
            like[near] = k
            near += 1
    chosen = unpainted
    if board.size:
        chosen, count = like, near if near > count // 4 else 0
    step, median, values = max(count // _JUDGED, 1), np.zeros(3, np.float32), np.empty(count)
    looked = (count + step - 1) // step
    for channel in range(3 if count else 0):
        for k in range(looked):
            values[k] = colors[chosen[k * step], channel]
        median[channel] = upper_median(values, looked)
    return count, median


@kernel("Tuple((f4[::1], b1[::1], b1[::1], b1[::1]))(f4[:, ::1], f4[::1], f4[::1], f8)")
def light_of(
    colors: np.ndarray, board: np.ndarray, paint: np.ndarray, gate: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """In which light the board would look like each sample.

    Args:
        colors: Samples, (n, 3).
        board: Colour of the board in the light of the reference, (3,).
        paint: Colour of the paint, (3,): samples of it have not the board's tint.
        gate: Distance within which a colour is the board's in that light.

    Returns:
        The light, times the reference's; which samples are cut off, which have the board's tint in some light or are
        cut off, and which of these have its colour in the reference's light, (n,) each.
    """
    count = len(colors)
    light, cut = np.empty(count, np.float32), np.empty(count, np.bool_)
    tinted, even = np.empty(count, np.bool_), np.empty(count, np.bool_)
    size = max(board[0] * board[0] + board[1] * board[1] + board[2] * board[2], np.float32(1.0))
    gate_squared, sure = np.float32(gate * gate), np.float32((SURE * gate) ** 2)
    paint_color, shown = known(paint), np.minimum(board, _WHITE)
    for k in range(count):
        red, green, blue = colors[k]
        own = (red * board[0] + green * board[1] + blue * board[2]) / size
        whole = red * red + green * green + blue * blue
        off = max(whole - own * own * size, np.float32(0.0))
        tint = np.float32(_BOARD_TINT * gate) * own
        light[k] = own
        cut[k] = max(red, green, blue) >= _CUT
        tinted[k] = cut[k] or (own > _DIMMEST and own < _BRIGHTEST and off < tint * tint)
        tinted[k] &= squared_distance(red, green, blue, paint_color) > gate_squared
        # a dark board's colour holds in much light, the paint's on it does not
        even[k] = (
            tinted[k]
            and squared_distance(red, green, blue, shown) < sure
            and abs(own - np.float32(1.0)) < np.float32(UNEVEN)
        )
    return light, cut, tinted, even


@kernel("Tuple((i8, f8))(f4[:, ::1], f4[::1], f4[::1], f8)")
def painted_light(colors: np.ndarray, paint: np.ndarray, board: np.ndarray, gate: float) -> tuple[int, float]:
    """In which light samples show the paint.

    Args:
        colors: Samples, (n, 3).
        paint: Colour of the paint as it was named, (3,).
        board: Colour of the board, (3,).
        gate: Distance within which a colour matches.

    Returns:
        How many have the paint's tint in some light and not the board's colour, and the median of their light, times
        that in which the paint was named.
    """
    light, count = np.empty(len(colors)), 0
    size = max(paint[0] * paint[0] + paint[1] * paint[1] + paint[2] * paint[2], np.float32(1.0))
    for k in range(len(colors)):
        red, green, blue = colors[k]
        own = (red * paint[0] + green * paint[1] + blue * paint[2]) / size
        tint = np.float32(_PAINT_TINT * gate) * own
        expected = own * paint[0], own * paint[1], own * paint[2]
        if not (own > _DIMMEST and own < _BRIGHTEST):
            continue
        if not squared_distance(red, green, blue, expected) < tint * tint:
            continue
        if squared_distance(red, green, blue, board) > np.float32(gate * gate):
            light[count] = own
            count += 1
    above, below = upper_median(light, count), 0.0
    if count % 2 or count == 0:
        return count, above
    for k in range(count // 2):
        below = max(below, light[k])
    return count, float(np.float32(0.5 * (above + below)))
