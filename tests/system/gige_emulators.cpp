// GigE Vision cameras without hardware: gige_emulators NAME=ADDRESS... Prints "ready" and obeys
// lines on standard input until that ends:
//   set NAME FIELD VALUE   a field of GigeEmulatorClock, of one camera or of all ("*")
//   resend NAME 0|1        whether it can resend packets
//   line                   an edge at the trigger input of all cameras
// Belongs into a network namespace of its own.
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "base/host_clock.h"
#include "simulation/gige_emulator/gige_emulator.h"

namespace weft {
namespace {

using Cameras = std::map<std::string, std::unique_ptr<GigeEmulator>>;

bool Obey(const std::string& line, const Cameras& cameras) {
  std::istringstream words(line);
  std::string verb, name, field;
  double value = 0;
  words >> verb;
  if (verb == "line") {
    const int64_t now_ns = HostTime_ns();
    for (const auto& [_, camera] : cameras) camera->PulseLine(now_ns);
    return true;
  }
  words >> name;
  if (verb == "set") words >> field;
  words >> value;
  if (!words || (name != "*" && !cameras.contains(name))) return false;
  for (const auto& [id, camera] : cameras) {
    if (name != "*" && name != id) continue;
    if (verb == "set") {
      camera->SetClock(field, value);
    } else {
      camera->SetResend(value != 0);
    }
  }
  return verb == "set" || verb == "resend";
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  weft::Cameras cameras;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = argument.find('=');
    if (equals == std::string::npos) return 2;
    const std::string name = argument.substr(0, equals);
    cameras[name] = std::make_unique<weft::GigeEmulator>(name, argument.substr(equals + 1));
  }
  std::puts("ready");
  std::fflush(stdout);
  std::string line;
  while (std::getline(std::cin, line)) {
    if (!weft::Obey(line, cameras)) {
      std::fprintf(stderr, "gige_emulators: not understood: %s\n", line.c_str());
      std::_Exit(2);
    }
    std::puts("done");
    std::fflush(stdout);
  }
  std::_Exit(0);
}
