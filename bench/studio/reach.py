"""How often a drag of the studio's hand towards a moving arm meets that arm, in a real browser.

    python bench/studio/reach.py --drags 20 --seed 1 > bench/studio/reach.txt
    python bench/studio/reach.py --drags 20 --seed 2 --arm left >> bench/studio/reach.txt

Each drag looks from a random side, takes the hand where it is seen, and goes in half a second to
where a random arm is seen, give or take 10 pixels, corrected once on the way as people do. It
stays there for at most 8 s while the robot goes on with wide gestures.
"""

import argparse
from typing import Any

import numpy as np
from playwright.sync_api import Page, sync_playwright
from programs import partner

from miburi.robot import forward, iphonoid

FLAGS = ["--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
GESTURES = ("happiness", "thrill", "surprise")
ARMS = ("right", "left")
LOOK = """([azimuth, height]) => {
  const view = document.querySelector('.robot-view').view;
  const [x, y] = [0.68 * Math.cos(azimuth), 0.68 * Math.sin(azimuth)];
  view.camera.position.set(x, y, height);
  view.controls.update();
}"""


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--drags", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--arm", choices=ARMS, help="by default either")
    wish = parser.parse_args()
    rng = np.random.default_rng(wish.seed)
    with partner() as one, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
        page = browser.new_page(viewport={"width": 1180, "height": 640}, locale="en-GB")
        page.goto(one.url + "/?quality=low")
        page.wait_for_function(
            "window.did_handshake && document.querySelector('.robot-view')?.view?.ready"
        )
        met = [drag(page, one.url, rng, number, wish.arm) for number in range(1, wish.drags + 1)]
        browser.close()
    print(f"{sum(met)} of {len(met)} drags met the arm that they aimed at (seed {wish.seed})")


def drag(page: Page, url: str, rng: np.random.Generator, number: int, only: str | None) -> bool:
    def post(path: str, **content: object) -> None:
        headers = {"Miburi-By": "program"}  # what it stops it releases
        page.request.post(f"{url}/api/v1{path}", data=content or None, headers=headers)

    def state() -> dict[str, Any]:
        return page.request.get(f"{url}/api/v1/state").json()

    def aim() -> tuple[float, float]:
        hands = forward(iphonoid(), np.array(state()["angles"]))
        return on_screen(page, hands[3 * arm : 3 * arm + 3].tolist())

    gesture, arm = str(rng.choice(GESTURES)), int(rng.integers(2))
    arm = arm if only is None else ARMS.index(only)
    side, height, error = rng.uniform(-0.9, 0.3), rng.uniform(0.12, 0.34), rng.uniform(-10, 10, 2)
    for _ in range(300):  # until it is free, and wide in a gesture
        now = state()
        if now["stop"]:
            post("/stop")
            post("/hand", position=None)
            post("/release")
        elif not now["asked"]:
            post("/express", feeling=gesture, mood=1.0)
        elif now["hand_speed"] > 0.08:
            break
        page.wait_for_timeout(100)
    page.evaluate(LOOK, [side, height])
    page.get_by_role("button", name="Reach in").click()
    page.wait_for_function("document.querySelector('.robot-view').view.hand.visible")
    page.wait_for_timeout(500)
    begin = on_screen(page, state()["hand"]["position"])
    page.mouse.move(*begin)
    page.mouse.down()
    goal = aim()
    for step in range(1, 11):
        if step == 6:
            goal = aim()
        way = np.array(goal) + error - begin
        page.mouse.move(*(begin + way * step / 10))
        page.wait_for_timeout(40)
    stop = None
    for _ in range(160):
        now = state()
        stop = now["stop"]
        if stop:
            break
        if not now["asked"]:
            post("/express", feeling=gesture, mood=1.0)
        page.wait_for_timeout(50)
    part = (stop or {}).get("part") or "-"
    page.mouse.up()
    post("/hand", position=None)
    print(f"{number:2}  {gesture:9}  {ARMS[arm]:5}  side {side:+.2f}  {part}", flush=True)
    return part.startswith(ARMS[arm])


def on_screen(page: Page, point: object) -> tuple[float, float]:
    x, y = page.evaluate("p => document.querySelector('.robot-view').view.screenOf(...p)", point)
    return x, y


if __name__ == "__main__":
    main()
