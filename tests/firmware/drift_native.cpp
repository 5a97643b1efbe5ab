// Reads readings of the motors, and says after each what a move that begins then is told of them.
// In: count, then for each reading its time, the start's time and 8 positions, in text; out: velocity
// and gone of each motor along both ways.
#include <cstdio>

#include "controller.h"

int main() {
  static miburi::Controller c;
  long count = 0;
  if (std::scanf("%ld", &count) != 1) {
    return 1;
  }
  for (long n = 0; n < count; n++) {
    long long time = 0;
    long long start = 0;
    int16_t positions[miburi::MOTORS];
    int16_t from[miburi::MOTORS];
    if (std::scanf("%lld %lld", &time, &start) != 2) {
      return 1;
    }
    for (uint8_t i = 0; i < miburi::MOTORS; i++) {
      if (std::scanf("%hd %hd", &positions[i], &from[i]) != 2) {
        return 1;
      }
    }
    miburi::note(c, positions, time);
    for (int8_t way = -1; way <= 1; way += 2) {
      for (uint8_t i = 0; i < miburi::MOTORS; i++) {
        miburi::Loading loading = miburi::Loading();
        c.watch.direction[i] = way;
        miburi::note_drift(c, i, from[i], start, loading);
        std::printf("%ld %ld ", static_cast<long>(loading.velocity), static_cast<long>(loading.gone));
      }
    }
  }
  return 0;
}
