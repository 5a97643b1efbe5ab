"""Talk happily to a partner: one sentence makes an emotion, a quarter of an hour a mood.

python happy_talk.py [FIGURE.png]
"""

import sys

import numpy as np

from miburi import EmotionalModel
from miburi.gestures import key_poses, load
from miburi.robot import forward, iphonoid
from miburi.senses import stimuli
from miburi.senses.words import hear

TALK = (
    "What a lovely day.", "I am so glad to see you.", "We had pancakes.", "That was delicious!",
    "My sister is coming tomorrow.", "I love her very much.", "You are a sweet little robot.",
    "The bus was on time.", "Thank you, that is kind of you.", "I feel wonderful.",
)  # fmt: skip
robot, model = iphonoid(), EmotionalModel()
happiness = 0  # its place in FEELINGS
moods = []
for sentence in range(45):  # one every 20 s
    for stimulus in stimuli(hear(TALK[sentence % len(TALK)]), model.temperament):
        model.stimulate(stimulus)
    for _ in range(20):
        model.step(1.0)
        moods.append(model.mood[happiness])
    if sentence in (0, 44):
        poses = key_poses(robot, load("happiness"), moods[-1])
        away = [np.abs(pose.target - forward(robot, robot.neutral)).max() for pose in poses]
        print(f"after {len(moods):3} s: mood {moods[-1]:.3f}, gesture {1e3 * max(away):3.0f} mm")
if len(sys.argv) > 1:
    import matplotlib.pyplot as plt

    plt.figure(figsize=(7, 2.6), layout="constrained")
    plt.plot(np.arange(900) / 60, moods, color="#e0a100")
    plt.gca().set(xlabel="minutes of happy talk", ylabel="mood, happiness", ylim=(0, None))
    plt.savefig(sys.argv[1], dpi=120)
