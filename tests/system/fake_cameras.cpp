// GigE Vision cameras without hardware, on Aravis's own camera end: fake_cameras SERIAL=ADDRESS...
// Prints "ready" and runs until it is killed. Belongs into a network namespace of its own.
#include <arv.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

int main(int argc, char** argv) {
  std::vector<ArvGvFakeCamera*> cameras;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = argument.find('=');
    if (equals == std::string::npos) return 2;
    ArvGvFakeCamera* camera =
        arv_gv_fake_camera_new(argument.substr(equals + 1).c_str(), argument.substr(0, equals).c_str());
    if (camera == nullptr || !arv_gv_fake_camera_is_running(camera)) {
      std::fprintf(stderr, "%s: no camera\n", argv[i]);
      return 1;
    }
    cameras.push_back(camera);
  }
  std::puts("ready");
  std::fflush(stdout);
  while (true) pause();
}
