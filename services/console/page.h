// SPDX-License-Identifier: Apache-2.0
/** @file Files of the page: path lookup and HTTP headers. */
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::console {

/** File of the page. */
struct PageFile {
  std::filesystem::path path;
  std::string type;      ///< Content-Type
  std::string etag;      ///< changes with the file
  bool lasting = false;  ///< its name changes with its contents: browsers may cache it
};

/** A folder with index.html. Every request reads the disk: files are few, and a rebuilt page takes effect at once. */
class Page {
 public:
  /// @param folder  empty: there is no page
  explicit Page(const std::filesystem::path& folder);

  bool present() const { return !folder_.empty(); }
  const std::filesystem::path& folder() const { return folder_; }
  /// The file of a path ("/" is index.html); empty if it does not exist or is outside the folder in any notation.
  std::optional<PageFile> find(std::string_view path) const;

 private:
  std::filesystem::path folder_;
};

/// Page in place of one that is not installed: lists the other resources of this server.
extern const std::string_view kNoPage;

/// Content-Security-Policy of the page: nothing from other servers, no framing.
extern const std::string_view kContentSecurityPolicy;

}  // namespace tandem::console
