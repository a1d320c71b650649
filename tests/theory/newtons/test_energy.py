"""The work of the motors bounds the energy, and so the elastic force of every contact."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given

import alight
from alight.models import HuntCrossley, KelvinVoigt, LinearSpring, Plant, PlantState, TwoLinkArm
from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.simulation.run import run
from alight.testbed import Encoder, Motors, Testbed
from alight.theory.newtons import available, elastic_force
from alight.theory.newtons.energy import gravity_potential, supplied
from tests.control.cases import PLANT, STABLE, told
from tests.strategies import between, log_between

IDEAL = Testbed(encoder=Encoder(0.0), motors=Motors(limit=(1e9, 1e9)))
CONTACTS = (
    LinearSpring(K_I=2e4),
    KelvinVoigt(K_I=2e4, damping=30.0),
    HuntCrossley(K_I=2e5, exponent=1.5, dissipation=0.5),
)


@pytest.mark.parametrize("contact", CONTACTS, ids=lambda c: c.type)
@given(penetration=log_between(1e-6, 1e-1))
def test_the_force_is_that_of_the_penetration_that_stores_the_energy(contact, penetration):
    energy = np.array([contact.energy(penetration)])
    force = contact.pressing(penetration, 0.0)
    assert elastic_force(contact, energy)[0] == pytest.approx(force, rel=1e-12)
    assert elastic_force(contact, -energy)[0] == 0


@given(energy=log_between(1e-6, 1e3), K_I=log_between(1e2, 1e6))
def test_for_the_spring_of_7_it_is_the_root_of_twice_stiffness_and_energy(energy, K_I):
    found = elastic_force(LinearSpring(K_I=K_I), np.array([energy]))[0]
    assert found == pytest.approx(np.sqrt(2 * K_I * energy), rel=1e-12)


@given(q=between(-6.0, 6.0), p=between(-6.0, 6.0), g1=between(0.0, 30.0), g2=between(0.0, 10.0))
def test_the_potential_of_gravity_is_the_height_of_the_links(q, p, g1, g2):
    arm = TwoLinkArm(0.35, 0.3, 3.4, 0.2, 0.24, "vertical", g1, g2)
    poses = np.array([[0.1, -0.2], [q, p]])
    heights = g1 * np.sin(poses[:, 0]) + g2 * np.sin(poses.sum(axis=1))
    np.testing.assert_allclose(gravity_potential(arm, poses), heights - heights[0], atol=1e-11)


def sampled_run(plant: Plant, duration: float = 0.4):
    law = told(plant, STABLE)
    q = plant.arm.inverse((plant.body.x_0 - 0.01, 0.4), "+")
    start = InitialState((float(q[0]), float(q[1])), plant.body.x_0)
    return run(ClosedLoop(plant, IDEAL, law, substeps=4), start, duration)


def stored(plant: Plant, recording: alight.Recording) -> np.ndarray:
    names = PlantState._fields
    return np.array(
        [
            plant.energy(PlantState(*(recording[name][k] for name in names)))
            for k in range(len(recording))
        ]
    )


def vertical(plant: Plant) -> Plant:
    arm = dataclasses.replace(plant.arm, plane="vertical", g1=20.0, g2=5.0)
    return dataclasses.replace(plant, arm=arm)


@pytest.mark.parametrize("plant", [PLANT, vertical(PLANT)], ids=["horizontal", "vertical"])
def test_under_a_held_torque_the_balance_is_exact_on_the_lossless_plant(plant):
    recording = sampled_run(plant)
    energy = stored(plant, recording)
    assert recording["Lambda"].any() and energy.max() > 0.01
    np.testing.assert_allclose(
        available(plant, recording, energy), energy, rtol=0, atol=1e-6 * energy.max()
    )


@pytest.mark.parametrize("contact", CONTACTS[1:], ids=lambda c: c.type)
def test_friction_and_damping_only_take(contact):
    arm = dataclasses.replace(PLANT.arm, viscous=(0.5, 0.2), coulomb=(0.2, 0.1))
    body = dataclasses.replace(PLANT.body, damping=2.0)
    plant = dataclasses.replace(PLANT, arm=arm, body=body, contact=contact)
    recording = sampled_run(plant)
    energy = stored(plant, recording)
    room = available(plant, recording, energy) - energy
    assert recording["Lambda"].any()
    assert (np.diff(room) >= -1e-7 * energy.max()).all()
    assert room[-1] > 1e-3 * energy.max()


def test_a_wrong_work_is_seen():
    """Half the work would leave less energy than there is."""
    recording = sampled_run(PLANT)
    energy = stored(PLANT, recording)
    assert (energy > energy[0] + supplied(recording) / 2 + 1e-3).any()
