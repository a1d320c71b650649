"""What tests of the page share."""

import dataclasses

import alight


def without_assumptions(scenario: alight.Scenario) -> alight.Scenario:
    document = dataclasses.replace(scenario.document, assumptions=None)
    return dataclasses.replace(scenario, document=document)
