// Where the motors are believed to be. A servo's reading may be wrong despite a good CRC: a place
// that it cannot have reached in the time that has passed is not believed.
//
// Positions are the servo's own, in steps; times µs.
#pragma once

#include "contact.h"

namespace miburi {

const int32_t JERK = 48;            // largest jump in steps that comes from play, noise or a knock
const int64_t LONGEST_GAP = 60000;  // µs; a longer silence does not make more travel believable
const int32_t FARTHEST = 1L << 20;  // an XL330 counts no further, in either direction
const uint8_t BAD_READING = 2;      // what an impossible reading adds to the doubt
const uint8_t TOO_DOUBTFUL = 4;     // this much doubt is a fault: two bad readings, or every other
const uint8_t SETTLED = 3;          // readings that agree on another place
const int32_t HANGS = 128;          // steps from its goal at which a held joint may hang
const uint8_t FIRST = 2;            // readings that agree on a place, at first or after silence

struct Place {
  int32_t steps;  // believed
  int64_t time;   // of the reading
  bool known;
  uint8_t doubt;
  int32_t strange;   // the latest reading that was not believed
  uint8_t agreeing;  // how many of these in a row agree
};

inline int32_t reach(int64_t time, uint16_t speed) {
  const int32_t gap = static_cast<int32_t>(time < LONGEST_GAP ? time : LONGEST_GAP);
  return JERK + ((gap >> 10) * speed >> 10);  // 2^20 µs is about a second, and a division is slow
}

// Positions that are accepted if several readings agree, although the joint could not have moved
// there in the time. A `limp` joint may be anywhere, since somebody may have turned it. A held
// joint may be where it is held, since it is pulled back there; anywhere else it is astray. A joint
// that was `lost` for a while may be on the way to its goal, since nobody watched it.
struct Elsewhere {
  bool limp;
  bool lost;
  int32_t held;  // where it is held or, if it was lost, its goal
};

inline bool may_be(const Elsewhere& elsewhere, const Place& place, int32_t reading) {
  const int32_t held = elsewhere.held;
  const int32_t other = elsewhere.lost ? place.steps : held;
  const int32_t low = held < other ? held : other;
  const int32_t high = held < other ? other : held;
  return elsewhere.limp || (reading >= low - HANGS && reading <= high + HANGS);
}

// Takes in a reading; returns whether it is believed: no motor is faster than `fastest` steps/s.
inline bool believe(Place& place, int32_t reading, int64_t time, uint16_t fastest,
                    const Elsewhere& elsewhere) {
  reading = reading > FARTHEST ? FARTHEST : reading < -FARTHEST ? -FARTHEST : reading;
  const int32_t may = reach(time - place.time, fastest);
  bool believed = place.known && distance_between(reading, place.steps) <= may;
  if (believed) {
    place.doubt = static_cast<uint8_t>(place.doubt ? place.doubt - 1 : 0);
  } else {
    // A joint that was lost may still be on its way.
    const int32_t near = elsewhere.lost ? reach(LONGEST_GAP, fastest) : JERK;
    const bool agrees = place.agreeing && distance_between(reading, place.strange) <= near;
    place.agreeing = static_cast<uint8_t>(agrees ? place.agreeing + 1 : 1);
    place.strange = reading;
    if (place.known && place.doubt < TOO_DOUBTFUL) {
      place.doubt = static_cast<uint8_t>(place.doubt + BAD_READING);
    }
    const bool first = !place.known || elsewhere.lost;
    believed = place.agreeing >= (first ? FIRST : SETTLED) &&
               (!place.known || may_be(elsewhere, place, reading));
  }
  if (believed) {
    place.steps = reading;
    place.time = time;
    place.known = true;
    place.agreeing = 0;
  }
  return believed;
}

}  // namespace miburi
