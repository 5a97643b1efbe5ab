// The card's clock: 64 bits of microseconds that never wrap.
#pragma once

#include <stdint.h>

namespace miburi {

template <class Io>
class Clock {
 public:
  explicit Clock(Io& io) : io_(io) {}

  // Must be called at least once every 71 minutes.
  int64_t now() {
    const uint32_t ticks = io_.micros();
    clock_ += static_cast<uint32_t>(ticks - ticks_);
    ticks_ = ticks;
    return clock_;
  }

 private:
  Io& io_;
  uint32_t ticks_ = 0;
  int64_t clock_ = 0;
};

}  // namespace miburi
