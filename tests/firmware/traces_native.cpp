// Traces from standard input to decisions on standard output; `roots` checks the square root.
#include <cstdint>
#include <cstdio>
#include <cstring>

#include "trace.h"

struct Stdio {
  uint8_t get() { return static_cast<uint8_t>(std::getchar()); }
  void put(uint8_t byte) { std::putchar(byte); }
};

int main(int count, char** words) {
  Stdio stdio;
  Numbers<Stdio> in{stdio};
  if (count > 1 && std::strcmp(words[1], "roots") == 0) {
    for (int n = in.i32(); n > 0; n--) {
      const uint64_t root = miburi::square_root(in.take(8));
      std::fwrite(&root, sizeof root, 1, stdout);
    }
    return 0;
  }
  for (int n = in.i32(); n > 0; n--) {
    run_trace(in, stdio);
  }
  return 0;
}
