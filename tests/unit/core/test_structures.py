"""Linear properties of general structures against 50-digit arithmetic made from their matrices."""

from __future__ import annotations

import tracemalloc
from dataclasses import dataclass

import numpy as np
import pytest
from flint import acb, arb
from scipy.linalg import block_diag

from grazemap_core.errors import ConditioningError, ParameterError
from grazemap_core.model import harmonic_response
from grazemap_core.model.drive import base_in_space, base_with_stops, force
from grazemap_core.model.equilibrium import effective_gaps, equilibrium
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.summary import summary
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.structure_oracle import StructureOracle
from tests.support.general_systems import positive
from tests.support.refused import refused
from tests.support.thorough import the_first


@dataclass(frozen=True)
class System:
    """An oscillator with matrices, and its oracle; forces in harmonics 1 and 2."""

    oscillator: Oscillator
    oracle: StructureOracle
    first: tuple[np.ndarray, np.ndarray]
    second: np.ndarray
    omega: float
    time: float


def random_system(seed: int) -> System:
    random = np.random.default_rng(seed)
    size = int(random.integers(1, 7))
    mass, stiffness = positive(random, size), positive(random, size)
    damping = 0.1 * positive(random, size) * random.choice([0.1, 1.0])
    if seed % 3 == 0:
        damping = 0.07 * stiffness
    elif seed % 3 == 1 and size > 1:  # gyroscopic
        turn = random.normal(size=(size, size))
        damping = damping + (turn - turn.T)
    contact = random.normal(size=size)
    if size > 1 and seed % 2:
        contact = np.eye(size)[0] - np.eye(size)[1]
    amplitude, phase, second = random.normal(size=(3, size))
    oscillator = Oscillator.of_structure(
        Matrices.create(mass, stiffness, damping),
        contact,
        [force(1, amplitude, phase), force(2, second, unbalance=True)],
        0.8,
        random.normal(size=size),
    )
    structure = oscillator.structure
    oracle = StructureOracle(structure.mass_matrix, structure.damping_matrix, structure.stiffness_matrix, contact)
    return System(oscillator, oracle, (amplitude, phase), second, *random.uniform(0.2, 3.0, size=2))


def first_forces(system: System):
    turned = system.first[0] * (np.cos(system.first[1]) + 1j * np.sin(system.first[1]))
    return lambda omega: [acb(float(f.real), float(f.imag)) for f in turned]


def second_forces(system: System):
    return lambda omega: [acb(4 * omega * omega * arb(float(u))) for u in system.second]


@pytest.mark.parametrize("seed", the_first(20, range(200)))
def test_random_structures_agree_with_fifty_digits(seed: int) -> None:
    system = random_system(seed)
    figures = summary(system.oscillator, [system.omega], [system.time])
    oracle = system.oracle
    assert figures.effective_mass == pytest.approx(oracle.effective_mass(), rel=1e-14)
    assert figures.kappa == pytest.approx(oracle.kappa(), rel=1e-13)
    assert figures.natural_frequencies == pytest.approx(oracle.natural_frequencies(), rel=1e-14)
    assert figures.impulse_response[0] == pytest.approx(oracle.impulse_response(system.time), rel=1e-12, abs=1e-14)
    assert (figures.contact_weights**2).sum() == pytest.approx(1.0 / figures.effective_mass, rel=1e-13)
    for harmonic, forces in zip(figures.harmonics, (first_forces(system), second_forces(system)), strict=True):
        amplitude, phase, slope = oracle.response(forces, harmonic.order, system.omega)
        assert harmonic.amplitude[0] == pytest.approx(amplitude, rel=1e-15)
        assert np.exp(1j * harmonic.phase[0]) == pytest.approx(np.exp(1j * phase), abs=1e-14)
        assert harmonic.amplitude_slope[0] == pytest.approx(slope, rel=1e-12)
    model = modal_model(system.oscillator)
    exponents = np.array(oracle.exponents())
    for decay, discriminant in zip(model.decay, model.discriminant, strict=True):
        ours = -decay + 1j * np.sqrt(complex(discriminant))
        assert np.min(np.abs(exponents - ours)) < 1e-14 * np.max(np.abs(exponents))
    residual = system.oscillator.stiffness_matrix @ figures.equilibrium - system.oscillator.bias
    assert residual == pytest.approx(0.0, abs=1e-13)
    assert figures.contact_equilibrium == pytest.approx(system.oscillator.contact @ figures.equilibrium, abs=1e-15)


def test_a_chain_and_its_matrices_agree() -> None:
    chain = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], [0.1, 0.3, 0.0], [1.0, 0.0, 0.0], 0.8)
    dense = Matrices.create(chain.mass_matrix, chain.stiffness_matrix, chain.damping_matrix)
    for contact in ([1.0, 0.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, -1.0]):
        both = [Oscillator.of_structure(structure, contact, chain.drive, 0.8) for structure in (chain.structure, dense)]
        ours, other = (summary(oscillator, [0.29, 0.9], [3.7, 20.0]) for oscillator in both)
        assert ours.harmonics[0].amplitude == pytest.approx(other.harmonics[0].amplitude, rel=1e-14)
        assert ours.impulse_response == pytest.approx(other.impulse_response, rel=1e-12)
        assert ours.contact_weights == pytest.approx(other.contact_weights, rel=1e-13)
        assert ours.damping_ratios == pytest.approx(other.damping_ratios, rel=1e-13)


def test_a_contact_within_a_stiff_chain_keeps_its_digits() -> None:
    # the first two masses move together to 1e-10 of their displacements: differences of these have no such digits
    chain = Oscillator.create([1.0, 10.0, 10.0], [1e10, 5.0, 5.0], 1e-3, [1.0, 0.0, 0.0], 0.8)
    inner = Oscillator.of_structure(chain.structure, [1.0, -1.0, 0.0], chain.drive, 0.8)
    oracle = StructureOracle(
        chain.mass_matrix,
        [[2e-3 * x for x in row] for row in chain.stiffness_matrix],
        chain.stiffness_matrix,
        [1, -1, 0],
    )
    figures = summary(inner, [0.3], [])
    amplitude, _, _ = oracle.response(lambda _: [acb(1), acb(0), acb(0)], 1, 0.3)
    assert amplitude < 1e-9
    assert figures.harmonics[0].amplitude[0] == pytest.approx(amplitude, rel=1e-14)


def test_ratios_and_rayleigh_damping_are_what_they_say() -> None:
    random = np.random.default_rng(7)
    mass, stiffness = positive(random, 4), positive(random, 4)
    frequencies = np.array(StructureOracle(mass, mass, stiffness, [1, 0, 0, 0]).natural_frequencies())

    def ratios(**damping: object) -> np.ndarray:
        structure = Matrices.create(mass, stiffness, **damping)  # type: ignore[arg-type]
        return summary(Oscillator.of_structure(structure, np.ones(4), [], 0.8), [], []).damping_ratios

    assert ratios(modal=0.02) == pytest.approx(0.02, rel=1e-14)
    assert ratios(modal=[0.01, 0.02, 0.5, 1.5]) == pytest.approx([0.01, 0.02, 0.5, 1.5], rel=1e-14)
    assert ratios(rayleigh=[0.1, 0.2]) == pytest.approx(0.05 / frequencies + 0.1 * frequencies, rel=1e-13)
    # the matrix of the ratios is that of a structure with these ratios
    matrix = Matrices.create(mass, stiffness, modal=[0.01, 0.02, 0.5, 1.5]).damping_matrix
    assert ratios(damping=matrix) == pytest.approx([0.01, 0.02, 0.5, 1.5], rel=1e-13)


def test_a_moving_base_is_seen_alike_from_space_and_from_the_ground() -> None:
    # X in space is X relative to the ground plus the ground's own motion along the contact (general theory, 8)
    chain = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [0.0, 0.0, 0.0], 0.8).structure
    ones = np.ones(3)
    space = Oscillator.of_structure(chain, [1.0, 0.0, 0.0], [base_in_space(1.0, *chain.ground_forces(ones))], 0.8)
    ground = Oscillator.of_structure(chain, [1.0, 0.0, 0.0], [base_with_stops(1.0, chain.mass_matrix @ ones)], 0.8)
    seen = [summary(oscillator, [0.29], []).harmonics[0] for oscillator in (space, ground)]
    absolute, relative = (harmonic.amplitude[0] * np.exp(1j * harmonic.phase[0]) for harmonic in seen)
    assert absolute == pytest.approx(relative + 1.0, rel=1e-14)


def test_a_mode_that_contact_does_not_see_may_be_free() -> None:
    structure = Matrices.create(np.eye(2), [[1.0, -1.0], [-1.0, 1.0]], [[0.1, -0.1], [-0.1, 0.1]])
    drive = [force(1, np.array([1.0, -1.0]))]
    figures = summary(Oscillator.of_structure(structure, [1.0, -1.0], drive, 0.8, [0.3, -0.3]), [0.5], [2.0])
    assert figures.natural_frequencies == pytest.approx([0.0, np.sqrt(2.0)], abs=1e-15)
    assert figures.contact_weights[0] == 0.0
    # q'' + 0.2 q' + 2 q = 2 sin(omega t)
    assert figures.harmonics[0].amplitude[0] == pytest.approx(2.0 / abs(2.0 - 0.25 + 0.1j), rel=1e-14)
    assert figures.contact_equilibrium == pytest.approx(0.3, rel=1e-14)
    damped = np.sqrt(1.99)
    assert figures.impulse_response[0] == pytest.approx(np.exp(-0.2) * np.sin(2 * damped) / damped, rel=1e-13)
    with pytest.raises(ParameterError, match="free mode"):
        summary(Oscillator.of_structure(structure, [1.0, 0.0], drive, 0.8), [0.5], [])
    with pytest.raises(ParameterError, match="no equilibrium"):
        equilibrium(Oscillator.of_structure(structure, [1.0, -1.0], drive, 0.8, [0.3, 0.0]))


def free_chain(stiffness: float) -> tuple[np.ndarray, np.ndarray]:
    """Masses and springs of a free chain of three whose springs differ in stiffness."""
    return np.diag([1.0, 2.0, 3.0]), np.array(
        [[1.0, -1.0, 0.0], [-1.0, 1.0 + stiffness, -stiffness], [0.0, -stiffness, stiffness]]
    )


DAMPERS_BETWEEN = np.array([[0.28, -0.21, -0.07], [-0.21, 0.45, -0.24], [-0.07, -0.24, 0.31]])
TURNED_AND_BETWEEN = DAMPERS_BETWEEN + 0.2 * np.array([[0.0, 1.0, -1.0], [-1.0, 0.0, 1.0], [1.0, -1.0, 0.0]])


@pytest.mark.parametrize("damping", [DAMPERS_BETWEEN, TURNED_AND_BETWEEN, None], ids=["between", "turned", "modal"])
@pytest.mark.parametrize("stiffness", [1.0, 1e3, 1e5, 1e8])
def test_a_contact_within_a_free_structure_moves_as_in_fifty_digits(
    damping: np.ndarray | None, stiffness: float
) -> None:
    mass, springs = free_chain(stiffness)
    modal = 0.05 if damping is None else None
    structure = Matrices.create(mass, springs, damping, modal=modal)
    model = modal_model(Oscillator.of_structure(structure, [1.0, -1.0, 0.0], [], 0.8))
    assert np.count_nonzero(model.frequency_squared == 0.0) == 1
    assert not np.any(model.contact_row[model.frequency_squared == 0.0])
    for time in (1.0, 30.0):
        blocks = [
            np.reshape(block_flow(*numbers, time), (2, 2))
            for numbers in zip(model.decay, model.discriminant, model.frequency_squared, strict=True)
        ]
        flow = model.from_modal @ block_diag(*blocks) @ model.to_modal
        exact = np.array(StructureOracle(mass, structure.damping_matrix, springs, []).flow(time))
        # times of the fastest mode and masses have roundings; displacements grow with time
        assert flow == pytest.approx(exact, abs=4e-15 * np.sqrt(stiffness) * time * np.abs(exact).max())


def test_a_free_mode_that_couples_to_others_is_refused_by_name() -> None:
    mass, springs = free_chain(2.0)
    pushed = DAMPERS_BETWEEN + np.array([[0.0, 0.1, -0.1], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    for damping in (np.diag([0.1, 0.0, 0.0]), DAMPERS_BETWEEN + np.diag([0.0, 0.0, 1e-3]), pushed):
        with pytest.raises(ParameterError, match="free mode") as caught:
            modal_model(Matrices.create(mass, springs, damping))
        assert caught.value.name == "damping"
    follower = springs + np.array([[0.0, 0.0, 0.0], [0.1, -0.1, 0.0], [0.0, 0.0, 0.0]])
    with pytest.raises(ParameterError, match="free mode") as caught:
        modal_model(Matrices.create(mass, follower, DAMPERS_BETWEEN))
    assert caught.value.name == "stiffness"
    # damping that is proportional to the masses resists it and couples nothing
    assert modal_model(Matrices.create(mass, springs, 0.1 * mass)).decay == pytest.approx(0.05, rel=1e-14)


def test_follower_forces_that_flutter_without_damping_have_no_natural_frequencies() -> None:
    structure = Matrices.create(np.eye(2), [[1.0, 0.5], [-0.5, 1.0]], np.eye(2))
    figures = summary(Oscillator.of_structure(structure, [1.0, 0.0], [], 0.8), [], [])
    assert np.all(np.isnan(figures.natural_frequencies))
    assert figures.contact_weights is None


PART = tuple(
    np.array(matrix) for matrix in ([[1.0, 0.0], [0.0, 2.0]], [[0.3, -0.1], [-0.1, 0.1]], [[2.0, -1.0], [-1.0, 1.0]])
)
TURNING = (np.eye(2), np.array([[0.2, 0.5], [-0.5, 0.1]]), np.diag([1.0, 2.0]))
OVERDAMPED = (np.eye(2), np.array([[6.0, -1.0], [-1.0, 2.0]]), np.diag([1.0, 2.0]))
STIFF = (np.eye(2), 1e2 * np.array([[0.3, -0.1], [-0.1, 0.1]]), np.array([[1e6, -1e3], [-1e3, 1e4]]))


def flow_error(structure: Matrices, time: float) -> float:
    """The error of the free motion, in the energy norm of a structure with symmetric stiffness."""
    model = modal_model(structure)
    blocks = [
        np.reshape(block_flow(*numbers, time), (2, 2))
        for numbers in zip(model.decay, model.discriminant, model.frequency_squared, strict=True)
    ]
    flow = model.from_modal @ block_diag(*blocks) @ model.to_modal
    oracle = StructureOracle(structure.mass_matrix, structure.damping_matrix, structure.stiffness_matrix, [])
    exact = np.array(oracle.flow(time))
    weights = block_diag(*(np.linalg.cholesky(m).T for m in (structure.stiffness_matrix, structure.mass_matrix)))
    return float(np.linalg.norm(weights @ (flow - exact) @ np.linalg.inv(weights), 2))


@pytest.mark.parametrize("part", [PART, TURNING, OVERDAMPED, STIFF], ids=["damped", "turning", "overdamped", "stiff"])
@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("joined", [0.0, 1e-17, 1e-15, 1e-12, 1e-9])
def test_equal_parts_that_are_joined_weakly_or_not_at_all_move_as_in_fifty_digits(
    part: tuple[np.ndarray, ...], count: int, joined: float
) -> None:
    mass, damping, stiffness = (block_diag(*[matrix] * count) for matrix in part)
    spring = joined * part[2][0, 0]
    for i, j, sign in ((0, 0, 1.0), (2, 2, 1.0), (0, 2, -1.0), (2, 0, -1.0)):
        stiffness[i, j] += sign * spring
        damping[i, j] += sign * joined * part[1][0, 0]
    structure, alone = Matrices.create(mass, stiffness, damping), Matrices.create(*(part[i] for i in (0, 2, 1)))
    slowest = float(np.sqrt(np.linalg.eigvalsh(part[2])[0]))
    for time in (1.0 / slowest, 30.0 / slowest):
        assert flow_error(structure, time) < 4.0 * flow_error(alone, time) + 4e-14


@pytest.mark.parametrize("force_on_other", [1e-13, 1e-11, 1e-9, 1e-2])
def test_equal_parts_of_which_one_pushes_the_other_are_refused(force_on_other: float) -> None:
    """Their modes are defective together: the other part is in resonance with the one that pushes it."""
    mass, damping, stiffness = (block_diag(matrix, matrix) for matrix in PART)
    stiffness[0, 3] = -force_on_other
    with pytest.raises(ConditioningError):
        modal_model(Matrices.create(mass, stiffness, damping))


def test_a_structure_with_equal_branches_hits_its_stop_as_in_fifty_digits() -> None:
    """A hub with four branches, of which only the hub is damped otherwise: three modes are equal."""
    stiffness = np.diag([5.0, 2.0, 2.0, 2.0, 2.0])
    stiffness[0, 1:] = stiffness[1:, 0] = -1.0
    structure = Matrices.create(np.eye(5), stiffness, np.diag([0.3, 0.1, 0.1, 0.1, 0.1]))
    drive = [force(1, np.array([1.0, 0.5, 0.0, 0.0, 0.0]))]
    oscillator = Oscillator.of_structure(structure, [1.0, 0.0, -0.5, 0.0, 0.0], drive, 0.8)
    run = trajectory(oscillator, 0.9, (0.2, 0.3), np.zeros(5), np.zeros(5), periods=6)
    exact = GeneralOracle.of(oscillator, 0.9, 0.2, 0.3)
    exact.run(until=6.0 * 2.0 * np.pi / 0.9)
    assert len(exact.times) > 10
    np.testing.assert_allclose(run.impacts.time, [float(time) for time in exact.times], rtol=1e-11)


def test_gaps_are_those_from_the_equilibrium() -> None:
    chain = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
    biased = Oscillator.of_structure(chain.structure, chain.contact, chain.drive, 0.8, [0.05, 0.0, 0.0])
    assert effective_gaps(biased, 1.65, 1.65) == pytest.approx((1.58, 1.72), rel=1e-15)
    assert effective_gaps(biased, 0.05, 1.65) == pytest.approx((-0.02, 1.72), rel=1e-13)
    assert effective_gaps(biased, None, 1.65)[0] == np.inf
    with pytest.raises(ParameterError, match="clearance"):
        effective_gaps(biased, 0.1, -0.2)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("mass", {"mass": [[1.0, 2.0], [2.0, 1.0]]}),
        ("mass", {"mass": [[1.0, 0.5], [0.0, 1.0]]}),
        ("mass", {"mass": [[1.0, 0.0]]}),
        ("stiffness", {"stiffness": [[1.0]]}),
        ("stiffness", {"stiffness": [[1.0, 0.0], [0.0, np.nan]]}),
        ("damping", {"damping": [[1.0]]}),
        ("damping", {"damping": None, "modal": [0.1]}),
        ("damping", {"damping": None, "modal": -0.1}),
    ],
)
def test_matrices_that_cannot_be_are_refused_by_name(name: str, change: dict[str, object]) -> None:
    fields = {"mass": np.eye(2), "stiffness": np.eye(2), "damping": np.zeros((2, 2))} | change
    with refused(name):
        Matrices.create(**fields)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "stiffness", "damping"),
    [
        ("stiffness", [[1.0, 0.0], [0.0, -1.0]], np.eye(2)),
        ("damping", np.eye(2), [[-0.1, 0.0], [0.0, 0.1]]),
        ("damping", [[1.0, 1.0], [-1.0, 1.0]], np.zeros((2, 2))),  # follower forces
        ("damping", np.diag([1.0, 2.0]), [[0.1, 0.0], [0.3, -0.2]]),
    ],
)
def test_motions_that_grow_are_refused_by_name(name: str, stiffness: object, damping: object) -> None:
    structure = Matrices.create(np.eye(2), stiffness, damping)  # type: ignore[arg-type]
    with refused(name):
        modal_model(Oscillator.of_structure(structure, [1.0, 0.0], [], 0.8))


def test_an_equilibrium_that_refinement_does_not_find_is_unresolved(monkeypatch: pytest.MonkeyPatch) -> None:
    oscillator = Oscillator.of_structure(Matrices.create(np.eye(2), np.eye(2)), [1.0, 0.0], [], 0.8, [1.0, 2.0])
    assert equilibrium(oscillator).tolist() == [1.0, 2.0]
    unresolved = (np.zeros((1, 2), np.complex128), np.zeros(1, np.complex128), np.zeros(1, np.bool_))
    monkeypatch.setattr("grazemap_core.model.equilibrium.steady_amplitudes", lambda *_: unresolved)
    with refused("bias"):
        equilibrium(oscillator)


def test_the_response_at_many_frequencies_takes_the_memory_of_some(monkeypatch: pytest.MonkeyPatch) -> None:
    oscillator = Oscillator.create(np.ones(64), np.ones(64), 0.05, np.ones(64), 0.8)
    omega = np.linspace(0.2, 3.0, 2**14)
    whole = harmonic_response.contact_response(oscillator, omega)
    monkeypatch.setattr(harmonic_response, "FREQUENCIES_AT_ONCE", 2**10)
    tracemalloc.start()
    response = harmonic_response.contact_response(oscillator, omega)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2**14 * 64 * 16 / 2  # half of the amplitudes of all masses
    assert response.tobytes() == whole.tobytes()
