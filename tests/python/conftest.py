"""What the tests share: one small scene, so that few device programs are compiled."""
from pathlib import Path

import pytest

import itn

ROOT = Path(__file__).resolve().parents[2]
BALL = ROOT / "tests/tool/data/ball.xml"     # 32 x 24 pixels, a translucent ball
BY = ["skin.sigma_t", "haze.g"]              # the only derivatives that the tests ask for


@pytest.fixture
def ball():
    return itn.load(BALL)


@pytest.fixture(scope="session")
def photo():
    """Of the ball with sigma_t 7 instead of 10."""
    return itn.render(itn.load(BALL, sigma_t=7), spp=256, seed=5)
