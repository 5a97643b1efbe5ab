"""Say something kind to a partner every minute, and watch its three levels.

The emotion jumps at every remark, the feeling follows within minutes, the mood takes an hour.
"""

from miburi import EmotionalModel, Stimulus

model = EmotionalModel()
print("minute  emotion  feeling   mood   expresses")
for minute in range(1, 13):
    if minute <= 8:
        model.stimulate(Stimulus("happiness", 0.8, "speech"))
    model.step(2.0)  # seconds; nothing reads a clock
    levels = f"{model.emotion.max():7.3f}  {model.feeling.max():7.3f}  {model.mood.max():6.3f}"
    expression = model.express()
    print(f"{minute:6}  {levels}  {expression.feeling if expression else 'nothing'}")
    model.step(58.0)
