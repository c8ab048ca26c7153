// Feeds a fuzz target with mutations of its seeds: the same ones in every run, so that the ordinary suite
// needs no libFuzzer. Usage: fuzz_<target> [INPUTS] [SEED]; or fuzz_<target> FILE... to repeat single inputs.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "tests/fuzz/fuzz_target.h"

namespace {

using Random = std::mt19937_64;

size_t Below(Random& random, size_t limit) { return static_cast<size_t>(random() % limit); }

// Bytes and words that parsers trip over.
const std::vector<std::string>& Tokens() {
  static const std::vector<std::string> tokens = {"-1",
                                                  "0",
                                                  "1e308",
                                                  "nan",
                                                  "4294967296",
                                                  "99999999999999999999",
                                                  "\"",
                                                  "{",
                                                  "}",
                                                  "[",
                                                  "]",
                                                  ":",
                                                  ",",
                                                  "\n",
                                                  "\r\n",
                                                  " ",
                                                  std::string(1, '\0'),
                                                  "\xff\xff\xff\xff",
                                                  "\x7f\xff\xff\xff",
                                                  "../",
                                                  "\xd8\x00"};
  return tokens;
}

std::string Mutate(std::string input, const std::vector<std::string>& seeds, Random& random) {
  const size_t changes = 1 + Below(random, 6);
  for (size_t i = 0; i < changes; ++i) {
    const size_t at = Below(random, input.size() + 1);
    const size_t length = 1 + Below(random, std::max<size_t>(1, input.size() / 4));
    switch (Below(random, 7)) {
      case 0:
        input.resize(at);
        break;
      case 1:
        input.erase(at, length);
        break;
      case 2:
        input.insert(at, Tokens()[Below(random, Tokens().size())]);
        break;
      case 3:
        input.insert(at, input.substr(Below(random, input.size() + 1), length));
        break;
      case 4: {
        const std::string& other = seeds[Below(random, seeds.size())];
        input.insert(at, other.substr(Below(random, other.size() + 1), length));
        break;
      }
      case 5:
        if (at < input.size()) input[at] = static_cast<char>(random());
        break;
      default:
        if (at < input.size()) input[at] = static_cast<char>(input[at] ^ (1 << Below(random, 8)));
    }
    if (input.size() > (size_t{1} << 16)) input.resize(size_t{1} << 16);
  }
  return input;
}

std::string ReadBytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

// What libFuzzer found (run.py --keep), in an order of its own.
std::vector<std::string> KeptCorpus() {
  std::vector<std::string> paths, inputs;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(WEFT_FUZZ_CORPUS, error))
    paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) inputs.push_back(ReadBytes(path));
  return inputs;
}

void Run(const std::string& input) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(input.data()), input.size());
}

void End() {
  if (weft::fuzz_end != nullptr) weft::fuzz_end();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::filesystem::exists(argv[1])) {
    for (int i = 1; i < argc; ++i) Run(ReadBytes(argv[i]));
    End();
    return 0;
  }
  const size_t inputs = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 20000;
  const uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  std::vector<std::string> seeds = weft::FuzzSeeds();
  for (std::string& input : KeptCorpus()) seeds.push_back(std::move(input));
  if (seeds.empty() || inputs == 0) {
    std::fprintf(stderr, "no seeds or no inputs\n");
    return 2;
  }
  Random random(seed);
  Run("");
  for (const std::string& input : seeds) Run(input);
  for (size_t i = 0; i < inputs; ++i) Run(Mutate(seeds[Below(random, seeds.size())], seeds, random));
  End();
  std::printf("%zu inputs, no failure\n", inputs);
  return 0;
}
