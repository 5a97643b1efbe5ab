// The partner's voice: a chirp for each feeling by Web Audio, and words by a voice of this device, or
// by one of the partner's computer (`miburi run --voice`), whose sound comes from there.
// A sentence comes with the state; a new number is a new sentence, and the latest one wins.
import { lips } from "/static/face.js";
import { listen } from "/static/live.js";

const LOUDNESS = 0.22, BETWEEN = 2000, SYLLABLES = 5, SLOWEST = 5; // of 1; ms between two chirps; a second; letters a second

export function playChirp(context, to, notes, begin) {
  // Play [Hz, s] notes from a time on the context's clock, each sliding to the next; return the end.
  const voice = context.createOscillator(), swell = context.createGain();
  voice.type = "triangle";
  swell.gain.setValueAtTime(0, begin);
  let at = begin;
  for (const [pitch, length] of notes) {
    const edge = Math.min(0.02, length / 4);
    if (at === begin) voice.frequency.setValueAtTime(pitch, at);
    else voice.frequency.exponentialRampToValueAtTime(pitch, at + edge);
    swell.gain.linearRampToValueAtTime(LOUDNESS, at + edge);
    voice.frequency.setValueAtTime(pitch, at + length - edge / 2);
    swell.gain.setValueAtTime(LOUDNESS, at + length - edge);
    at += length;
    swell.gain.linearRampToValueAtTime(LOUDNESS / 4, at);
  }
  swell.gain.linearRampToValueAtTime(0, at + 0.03);
  voice.connect(swell).connect(to);
  voice.start(begin);
  voice.stop(at + 0.05);
  return at + 0.05;
}

export function localVoice(language) {
  // Others send the words to a server of the browser's maker.
  return speechSynthesis.getVoices().find((one) => one.localService && one.lang.startsWith(language)) ?? null;
}

export async function start({ voices }) {
  const context = new AudioContext(), meter = context.createAnalyser();
  const heights = new Float32Array((meter.fftSize = 512));
  meter.connect(context.destination);
  await context.resume();
  let spoken, felt, sounds = 0, last = -Infinity, syllables = null, later, words, speech = null, wish;
  window.speechSynthesis?.getVoices(); // some browsers load them when they are first asked for

  function chirp(feeling, tune) {
    const notes = tune ?? (voices.feelings[feeling] ?? voices.rest).chirp;
    last = performance.now();
    sounds = playChirp(context, meter, notes, context.currentTime + 0.02);
    return 1000 * (sounds - context.currentTime);
  }

  async function say(sentence) {
    hush();
    const wait = chirp(sentence.feeling, sentence.tune), begin = sounds, mine = (wish = new AbortController());
    if (sentence.tune) return;
    if (!voices.sounded.includes(sentence.language)) return speak(sentence, wait);
    const sound = await fetched(sentence.number, mine.signal);
    if (mine.signal.aborted) return;
    if (!sound) return speak(sentence, Math.max(0, 1000 * (begin - context.currentTime)));
    const at = Math.max(begin, context.currentTime);
    speech = new AudioBufferSourceNode(context, { buffer: sound });
    speech.connect(meter);
    speech.start(at);
    sounds = at + sound.duration;
  }

  async function fetched(number, signal) {
    try {
      const answer = await fetch(`/api/v1/voice/${number}`, { signal });
      return answer.ok ? await context.decodeAudioData(await answer.arrayBuffer()) : null;
    } catch {
      return null;
    }
  }

  function speak({ text, language, feeling }, wait) {
    const voice = "speechSynthesis" in window && localVoice(language);
    if (!voice) return;
    const { rate, pitch } = voices.feelings[feeling] ?? voices.rest;
    words = new SpeechSynthesisUtterance(text); // kept, or a browser may forget it before its end
    Object.assign(words, { voice, lang: voice.lang, rate, pitch });
    const longest = (1500 + (1000 * text.length) / SLOWEST) / rate; // where the device tells no end
    words.onstart = () => {
      const now = performance.now();
      syllables = { since: now, rate, until: now + longest };
    };
    words.onboundary = () => syllables && (syllables.since = performance.now());
    words.onend = words.onerror = () => (syllables = null);
    later = setTimeout(() => speechSynthesis.speak(words), wait);
  }

  function hush() {
    clearTimeout(later);
    wish?.abort();
    if (speech) {
      speech.stop();
      speech = null;
      sounds = 0; // its clock goes in steps, and may stand now
    }
    syllables = null;
    window.speechSynthesis?.cancel();
  }
  addEventListener("hush", hush);

  lips.open = (now) => {
    // Our own sound is measured. What the device speaks cannot be: there the mouth opens for each syllable.
    if (syllables?.until < now) syllables = null;
    if (syllables) return Math.abs(Math.sin(((now - syllables.since) / 1000) * Math.PI * SYLLABLES * syllables.rate));
    if (context.currentTime > sounds) return null;
    meter.getFloatTimeDomainData(heights);
    const power = heights.reduce((sum, height) => sum + height * height, 0) / heights.length;
    return Math.min(1, (1.7 * Math.sqrt(power)) / LOUDNESS);
  };

  const leave = listen((state) => {
    if (!state) return;
    const feeling = state.felt?.feeling, number = state.spoken?.number;
    const first = spoken === undefined, changed = feeling && feeling !== felt;
    const news = number !== spoken && state.spoken;
    spoken = number ?? null;
    felt = feeling;
    if (first) return; // what it said and felt before somebody listened is past
    if (news) say(news);
    else if (changed && !syllables && context.currentTime > sounds && performance.now() - last > BETWEEN) chirp(feeling);
  });

  return () => {
    leave();
    hush();
    removeEventListener("hush", hush);
    lips.open = () => null;
    context.close();
  };
}
