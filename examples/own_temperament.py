"""Give a partner a character of your own: own_temperament.toml, beside this file.

A rude guest and a friend talk to it in turns for ten minutes.
"""

from pathlib import Path

from miburi import EmotionalModel, Stimulus, load_temperament

own = load_temperament(Path(__file__).with_name("own_temperament.toml"))
for name, model in {"default": EmotionalModel(), own.name: EmotionalModel(own)}.items():
    for _ in range(15):
        model.stimulate(Stimulus("anger", 0.7, "speech"))
        model.step(20.0)
        model.stimulate(Stimulus("happiness", 0.7, "speech"))
        model.step(20.0)
    expression = model.express()
    print(f"{name:>8} shows {expression.feeling if expression else 'nothing'}", end="; ")
    model.step(1800.0)
    print(f"half an hour later its strongest mood is {model.mood.max():.2f}")
