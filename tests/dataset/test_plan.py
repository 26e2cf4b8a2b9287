"""What is drawn for a sample: the same for the same number, expressions that occur in faces."""

import math
from collections import Counter

import pytest

from facewrinkle.dataset.plan import expression_of, first_sample_of, person_of, plan_of
from facewrinkle.dataset.spec import Spec


@pytest.fixture(scope="module")
def drawn():
    spec = Spec.of()
    return [expression_of(spec.expression, spec.random(k, "expression")) for k in range(3000)]


def stems(expression):
    return {name.removesuffix("L").removesuffix("R") for name in expression}


def test_units_that_do_not_go_together_never_do(drawn):
    apart = Spec.of().expression.apart
    assert ("AU2", "AU4") in apart
    assert not [e for e in drawn if any({*pair} <= stems(e) for pair in apart)]


def test_shares_are_as_asked_for(drawn):
    neutral = sum(not e for e in drawn) / len(drawn)
    named = sum(any(not name.startswith("AU") for name in e) for e in drawn) / len(drawn)
    assert abs(neutral - 0.1) < 4.0 * (0.1 * 0.9 / 3000) ** 0.5
    assert abs(named - 0.4) < 4.0 * (0.4 * 0.6 / 3000) ** 0.5


def test_cheeks_are_raised_with_smiles_more_often_than_without(drawn):
    units = [stems(e) for e in drawn if any(name.startswith("AU") for name in e)]
    smiles, others = ([u for u in units if ("AU12" in u) == smiling] for smiling in (True, False))
    with_smile, without = (sum("AU6" in u for u in some) / len(some) for some in (smiles, others))
    assert with_smile > 2.0 * without > 0.0


def test_contractions_lie_in_their_range(drawn):
    values = [value for e in drawn for value in e.values()]
    assert min(values) >= 0.2
    assert max(values) <= 1.0


@pytest.mark.parametrize(("shard", "per_person"), [(100, 10), (12, 5), (3, 8), (7, 7), (5, 1)])
def test_persons_take_turns(shard, per_person):
    spec, size = Spec.of({"shard": shard, "per_person": per_person}), max(shard, per_person)
    people = [plan_of(spec, k).person for k in range(3 * size)]
    number = math.ceil(size / per_person)
    assert max(Counter(people).values()) <= per_person
    assert set(people) == set(range(3 * number))
    assert all(len({*people[k : k + number]}) == number for k in range(0, size - number + 1, number))
    assert not {*people[:size]} & {*people[size:]}  # who is seen in one shard is in no other
    assert all(people.index(person) == first_sample_of(spec, person) for person in set(people))


def test_24_pictures_show_more_than_three_persons():
    spec = Spec.of()
    for first in range(0, 200, 24):
        assert len({plan_of(spec, k).person for k in range(first, first + 24)}) > 3


def test_a_person_is_always_the_same():
    spec = Spec.of()
    assert person_of(spec, 2) == person_of(spec, 2) != person_of(spec, 3)
    assert all(person_of(spec, k).identity["hair"] >= person_of(spec, k).identity["skin"] for k in range(50))


@pytest.mark.slow
def test_skin_tones_are_even():
    people = [person_of(Spec.of(), k) for k in range(2000)]
    tones = Counter(person.monk for person in people)
    assert set(tones) == set(range(1, 11))
    assert max(abs(count - 200) for count in tones.values()) < 4.0 * (2000 * 0.1 * 0.9) ** 0.5
    assert abs(sum(person.identity["sex"] < 0.0 for person in people) - 1000) < 4.0 * (2000 * 0.25) ** 0.5


def test_all_cry_or_none():
    everybody, nobody = (Spec.of({"tears": {"share": share}}) for share in (1.0, 0.0))
    assert all(0.5 <= plan_of(everybody, k).tears <= 4.0 for k in range(20))
    assert all(plan_of(nobody, k).tears is None for k in range(20))
