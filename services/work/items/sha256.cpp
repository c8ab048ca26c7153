#include "services/work/items/sha256.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <vector>

#include "absl/strings/escaping.h"
#include "capture/file/posix_file.h"
#include "services/ground/process/unique_fd.h"

namespace weft {
namespace {

constexpr size_t kHashedPieceBytes = size_t{1} << 20;

void FreeContext(void* context) { EVP_MD_CTX_free(static_cast<EVP_MD_CTX*>(context)); }

}  // namespace

Sha256::Sha256() : context_(EVP_MD_CTX_new(), FreeContext) {
  EVP_DigestInit_ex(static_cast<EVP_MD_CTX*>(context_.get()), EVP_sha256(), nullptr);
}

Sha256& Sha256::Add(std::string_view bytes) {
  EVP_DigestUpdate(static_cast<EVP_MD_CTX*>(context_.get()), bytes.data(), bytes.size());
  return *this;
}

std::string Sha256::Hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  EVP_DigestFinal_ex(static_cast<EVP_MD_CTX*>(context_.get()), digest.data(), &size);
  return absl::BytesToHexString(std::string(reinterpret_cast<const char*>(digest.data()), size));
}

absl::StatusOr<std::string> Sha256OfFile(const std::string& path,
                                         const std::function<void(size_t bytes)>& read_piece) {
  const UniqueFd file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!file.open()) return FileError(path, "cannot be opened", errno);
  Sha256 hash;
  std::vector<char> piece(kHashedPieceBytes);
  for (;;) {
    const ssize_t n = read(file.get(), piece.data(), piece.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return FileError(path, "cannot be read", errno);
    if (n == 0) return hash.Hex();
    hash.Add({piece.data(), static_cast<size_t>(n)});
    if (read_piece) read_piece(static_cast<size_t>(n));
  }
}

}  // namespace weft
