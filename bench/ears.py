"""How well spoken phrases are told, and others left alone; the voices are flite's.

    python bench/ears.py > bench/ears.txt

Needs the extra ``ears`` and Debian's flite. None of these sentences was used to choose the
recogniser's threshold. Intervals are Wilson's, 95 %.
"""

import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "bench")]

from tests.fixtures.speech import VOICES, speak  # noqa: E402  (below the folder that holds it)
from words import share  # noqa: E402  (below the folder that holds it)

from miburi.senses.recogniser import PhraseRecogniser, load_phrases  # noqa: E402  (as above)
from miburi.senses.utterances import FRAME, utterances, voice_detector  # noqa: E402  (as above)
from miburi.senses.words import hear  # noqa: E402  (as above)

KNOWN = (
    "i am really glad", "i feel very sad", "i am not happy", "we are very proud",
    "i am feeling lonely again", "i am mad", "i'm so furious now", "i feel afraid",
    "i am really nervous", "we are excited", "i am so surprised", "i'm tired today",
    "that is so funny", "this is beautiful", "it was really horrible", "that was not nice",
    "you are amazing", "it is scary", "i love this", "i miss her", "i hate this",
    "we lost", "it is my birthday", "i am crying", "go away", "how dare you",
    "i did not expect that", "look out", "good morning", "what are you doing",
)  # fmt: skip
OTHER = (
    "the library closes at half past five", "she painted the kitchen wall green",
    "there are two chairs in the garden", "my uncle drives a yellow tractor",
    "could somebody open a window", "it costs eleven pounds and forty pence",
    "turn left behind the petrol station", "the cat is asleep under the table",
    "we had soup and bread for lunch", "his phone number ends with seven",
    "nobody knows where the ladder is", "write your name at the top of the page",
    "the bridge was built of stone", "put the parcel next to the door",
    "a hundred sheep stood on the hill", "he has worked there since april",
    "cut the paper along the line", "the film begins at eight",
    "my shoes are still wet", "which platform does it leave from",
    "the doctor will see them on monday", "a pint of milk and six eggs",
    "they sail around the island", "please wait behind the yellow line",
    "the cup broke into four pieces", "her coat hangs in the hall",
    "we need another battery", "the road is closed in winter",
    "he plays the violin in an orchestra", "count from one to twenty",
)  # fmt: skip


def main() -> None:
    """Measure and print."""
    recogniser = PhraseRecogniser(load_phrases())
    right = wrong = felt = foreign = 0
    by = dict.fromkeys(VOICES, 0)
    spent = length = 0.0
    for voice in VOICES:
        for text in (*KNOWN, *OTHER):
            sound = speak(text, voice)
            begin = time.process_time()
            heard = recogniser.recognise(sound)
            spent += time.process_time() - begin
            length += len(sound) / 32_000
            if text in OTHER:
                foreign += heard is not None
            else:
                right += heard == text
                by[voice] += heard == text
                wrong += heard not in (text, None)
                felt += heard is not None and hear(heard).feeling == hear(text).feeling
    n, others = len(KNOWN) * len(VOICES), len(OTHER) * len(VOICES)
    print(f"phrases heard as said: {share(right, n)}; {by}")
    print(f"heard, and the feeling of what was said: {share(felt, n)}")
    print(f"taken for another phrase: {share(wrong, n)}")
    print(f"other sentences taken for a phrase: {share(foreign, others)}")
    print(f"processor time for a second of sound: {spent / length:.2f} s")
    one = caught = 0
    rng = np.random.default_rng(5)
    detector = voice_detector()
    for voice in VOICES:
        for text in KNOWN:
            quiet = rng.normal(0, 30, 16_000).astype(np.int16).tobytes()
            sound = quiet + speak(text, voice) + quiet
            frames = [sound[at : at + FRAME] for at in range(0, len(sound) - FRAME + 1, FRAME)]
            pieces = list(utterances(frames, detector))
            one += len(pieces) == 1
            caught += any(recogniser.recognise(piece) == text for piece in pieces)
    print(f"phrases cut out of the quiet as one piece: {share(one, n)}")
    print(f"and then heard as said: {share(caught, n)}")
    noise = rng.normal(0, 1000, 60 * 16_000).astype(np.int16).tobytes()
    frames = [noise[at : at + FRAME] for at in range(0, len(noise) - FRAME + 1, FRAME)]
    print(f"utterances in a minute of noise: {len(list(utterances(frames, detector)))}")


if __name__ == "__main__":
    main()
