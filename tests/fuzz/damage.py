"""Damage to bytes, texts and JSON."""

import json

from hypothesis import strategies as st

from fuzz.values import rarely

leaves = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**70), 2**70),
    st.floats(),
    st.sampled_from(["", "natural", "clamped", "periodic", "not-a-knot", "sphere:2", "x", "\x00", "\ud800", "9" * 400]),
    st.text(max_size=5),
)
json_values = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.one_of(st.sampled_from(["re", "im", "method"]), st.text(max_size=3)), inner, max_size=3),
    ),
    max_leaves=6,
)


@st.composite
def damaged_bytes(draw, data, others=()):
    """Bytes with some changed, lost, moved, or taken from other files."""
    data = bytearray(data)
    for _ in range(draw(st.integers(1, 3))):
        how = draw(st.sampled_from(["set", "flip", "cut", "drop", "insert", "copy", "splice"]))
        at = draw(st.integers(0, max(0, len(data) - 1)))
        size = draw(st.sampled_from([1, 1, 2, 8, 100]))
        if how == "set" and data:
            data[at] = draw(st.integers(0, 255))
        elif how == "flip" and data:
            data[at] ^= 1 << draw(st.integers(0, 7))
        elif how == "cut":
            del data[at:]
        elif how == "drop":
            del data[at : at + size]
        elif how == "insert":
            data[at:at] = draw(st.binary(max_size=9))
        elif how == "copy":
            data[at : at + size] = data[draw(st.integers(0, max(0, len(data) - 1))) :][:size]
        elif how == "splice" and others:
            other = draw(st.sampled_from(others))
            data[at:] = other[draw(st.integers(0, max(0, len(other) - 1))) :]
    return bytes(data)


@st.composite
def damaged_json(draw, text):
    """JSON in which one value is another, or which is none."""
    if rarely(draw):
        return draw(st.one_of(st.text(max_size=20), st.sampled_from(["[" * 100_000, '{"a":' * 50_000, "1e999", "NaN"])))
    value = json.loads(text)
    return json.dumps(draw(_changed(value)))


@st.composite
def _changed(draw, value):
    if isinstance(value, dict) and value and not rarely(draw):
        key = draw(st.sampled_from(sorted(value)))
        rest = {k: v for k, v in value.items() if k != key}
        how = draw(st.sampled_from(["change", "change", "drop", "rename"]))
        return rest if how == "drop" else rest | {key if how == "change" else key + "x": draw(_changed(value[key]))}
    if isinstance(value, list) and value and not rarely(draw):
        at = draw(st.integers(0, len(value) - 1))
        how = draw(st.sampled_from(["change", "change", "drop", "twice"]))
        new = {"change": [draw(_changed(value[at]))], "drop": [], "twice": [value[at]] * 2}[how]
        return [*value[:at], *new, *value[at + 1 :]]
    return draw(json_values)
