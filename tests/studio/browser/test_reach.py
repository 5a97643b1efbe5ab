"""Reaching in: the hand goes as deep as the arm that one points at, by mouse and by keyboard."""

import math
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from tests.fixtures.browser import (
    ask,
    hand_has_come,
    needs_browser,
    on_screen,
    settled_on_screen,
    state,
    until,
)

from miburi.robot import forward, iphonoid
from miburi.robot.mjcf import HAND_SIZE

pytestmark = needs_browser

SIDES = {"from in front": [0.62, -0.27, 0.2], "from the left": [0.5, 0.4, 0.3]}


#: Moves the pointer to two places at once, as a quick hand does before it comes to rest.
LEAP = """places => {
  const canvas = document.querySelector('.robot-view canvas');
  for (const [clientX, clientY] of places)
    canvas.dispatchEvent(new PointerEvent('pointermove', {clientX, clientY, bubbles: true}));
}"""


def arm(now: dict[str, Any]) -> np.ndarray:
    """Where the right hand of the robot is, m."""
    return forward(iphonoid(), np.array(now["angles"]))[:3]


#: Notes each touch that the page hears of: one may fall between two looks. An arm that has been
#: stopped is soft and pushes back with a tenth of a newton.
FEEL = """() => import("/static/live.js").then(({listen}) => {
  window.touched = [];
  listen((state) => state.force > 0.01 && window.touched.push(state.hand.position));
})"""
HELD = "document.querySelector('.robot-view').view.held"


def reach_in(page: Page) -> dict[str, Any]:
    hint = page.get_by_role("button", name="Got it")
    hint.click()
    expect(hint).to_be_hidden()  # it moves the low scene up
    page.get_by_role("button", name="Reach in").click()
    expect(page.get_by_role("button", name="Take the hand away")).to_be_visible()
    return until(page, hand_has_come)


def take_hold(page: Page, place: list[float]) -> None:
    page.mouse.move(*settled_on_screen(page, place))
    page.mouse.down()
    page.wait_for_function(HELD)


@pytest.mark.proof("test_a_dragged_hand_stops_the_robot_and_release_lets_it_go_on")
@pytest.mark.parametrize("side", SIDES)
def test_the_hand_is_dragged_to_the_arm_that_is_pointed_at(scene: Page, side: str) -> None:
    ask(scene, "/pause", paused=True)  # the arm stays where it is
    until(scene, lambda now: now["phase"] == "idle" and now["hand_speed"] < 0.002)
    scene.evaluate(
        "eye => { const {camera, controls} = document.querySelector('.robot-view').view;"
        " camera.position.set(...eye); controls.update(); }",
        SIDES[side],
    )
    out = reach_in(scene)
    start, goal = out["hand"]["position"], arm(state(scene))
    scene.evaluate(FEEL)
    take_hold(scene, start)
    x, y = on_screen(scene, goal.tolist())
    scene.mouse.move(x - 40, y - 30, steps=8)
    scene.evaluate(LEAP, [[x - 30, y - 30], [x, y]])
    # It touches, where the arm was when it was pointed at; a soft arm gives way.
    until(
        scene,
        lambda _: any(
            math.dist(place, goal) < 3 * HAND_SIZE[0] for place in scene.evaluate("window.touched")
        ),
    )
    scene.mouse.up()
    assert scene.evaluate("document.querySelector('.robot-view').view.marks.ring.visible")
    assert scene.evaluate("document.querySelector('.robot-view').view.marks.shadow.visible")


@pytest.mark.proof("test_a_dragged_hand_stops_the_robot_and_release_lets_it_go_on")
def test_a_hand_whose_way_was_lost_on_the_wire_goes_there_all_the_same(scene: Page) -> None:
    ask(scene, "/pause", paused=True)
    out = reach_in(scene)
    take_hold(scene, out["hand"]["position"])
    x, y = on_screen(scene, out["hand"]["position"])
    scene.evaluate(
        "() => { const send = WebSocket.prototype.send;"
        " WebSocket.prototype.send = function (text) {"
        "  if (!String(text).includes('hand')) return send.call(this, text);"
        "  WebSocket.prototype.send = send; window.lost = text; }; }"
    )
    scene.mouse.move(x, y - 40)  # one step, whose only message is lost
    scene.wait_for_function("window.lost")
    until(scene, lambda now: math.dist(now["hand"]["position"], out["hand"]["position"]) > 0.03)
    scene.mouse.up()


def forget_the_arms_way(scene: Page) -> None:
    """Wait until the page, once drawn, knows the arms only where they have been since now."""
    scene.wait_for_function(
        "since => document.querySelector('.robot-view').view.arms.trail[0]?.now > since",
        arg=scene.evaluate("performance.now()"),
    )


def has_come(scene: Page, now: dict[str, Any]) -> bool:
    """Whether the hand is where the page wants it, not on its way."""
    wish = scene.evaluate("document.querySelector('.robot-view').view.wish.toArray()")
    return math.dist(now["hand"]["position"], wish) < 0.003


def test_the_arrow_keys_work_at_once(scene: Page) -> None:
    ask(scene, "/pause", paused=True)  # the hand goes as deep as the arm, which stays where it is
    until(scene, lambda now: now["phase"] == "idle" and now["hand_speed"] < 0.002)
    forget_the_arms_way(scene)  # where they were before would be deeper, or lower
    scene.get_by_role("button", name="Reach in").focus()
    scene.keyboard.press("Enter")
    until(scene, lambda now: now["hand_out"])
    expect(scene.locator(".robot-view canvas")).to_be_focused()
    scene.keyboard.press("ArrowUp")  # now it is as deep as the arms
    until(scene, lambda now: 0 < now["hand"]["position"][0] < 0.15)
    low = until(scene, lambda now: has_come(scene, now))["hand"]["position"]
    for _ in range(6):
        scene.keyboard.press("ArrowUp")
    until(scene, lambda now: now["hand"]["position"][2] > low[2] + 0.03)
    # A person looks first. Once the page has forgotten the arms' way, another place is the nearest.
    forget_the_arms_way(scene)
    raised = state(scene)["hand"]["position"]
    for _ in range(4):
        scene.keyboard.press("Shift+ArrowDown")  # towards the viewer
    until(scene, lambda now: now["hand"]["position"][0] > raised[0] + 0.02)
