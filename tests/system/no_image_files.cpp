// In place of OpenCV's image files, which the guest's program never opens: loading their hundred libraries
// would take the emulated processor half a minute.
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

namespace cv {

Mat imdecode(InputArray, int) { std::abort(); }
bool imencode(const String&, InputArray, std::vector<uchar>&, const std::vector<int>&) { std::abort(); }

}  // namespace cv
