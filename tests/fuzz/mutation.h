#pragma once
#include <array>
#include <random>
#include <string>
#include <string_view>
#include <vector>

/// Damage to the bytes of a file, the same for the same random numbers on every machine.
namespace repose::fuzz {

class Mutation {
 public:
  Mutation(uint64_t seed, uint64_t target, uint64_t input) : random_(mixed(seed, target, input)) {}

  /// One of the seeds with one to eight damages, most of them small.
  std::string of(const std::vector<std::string>& seeds) {
    std::string bytes = seeds[below(seeds.size())];
    for (uint64_t damages = 1 + below(below(8) + 1); damages > 0; --damages)
      damage(bytes, seeds[below(seeds.size())]);
    return bytes;
  }

 private:
  static std::mt19937_64 mixed(uint64_t seed, uint64_t target, uint64_t input) {
    std::seed_seq numbers{seed, seed >> 32, target, input, input >> 32};
    return std::mt19937_64(numbers);
  }
  uint64_t below(uint64_t limit) { return limit == 0 ? 0 : random_() % limit; }

  void damage(std::string& bytes, const std::string& other) {
    const size_t at = below(bytes.size() + 1),
                 length = below(std::min<size_t>(bytes.size() - at, 64) + 1);
    switch (below(9)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 1:
        if (at < bytes.size()) bytes[at] = static_cast<char>(random_());
        break;
      case 2:
        bytes.erase(at, length);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 4:
        bytes.resize(at);
        break;
      case 5:
        bytes.insert(at, other.substr(below(other.size() + 1), length));
        break;
      case 6:
        replace_number(bytes, at);
        break;
      case 7:
        write_number(bytes, at);
        break;
      default:
        bytes.insert(at, words[below(words.size())]);
    }
  }
  /// A number in words for the next one in the text.
  void replace_number(std::string& bytes, size_t at) {
    const size_t begin = bytes.find_first_of("0123456789", at);
    if (begin == std::string::npos) return;
    const size_t end = bytes.find_first_not_of("0123456789.eE+-", begin);
    bytes.replace(begin, end == std::string::npos ? end : end - begin,
                  numbers[below(numbers.size())]);
  }
  /// A whole number of 1, 2, 4 or 8 bytes of the kind that is forgotten.
  void write_number(std::string& bytes, size_t at) {
    constexpr std::array<uint64_t, 8> odd = {
        0, 1, 0x7f, 0x7fff, 0x7fffffff, 0xffffffff, 0x7fffffffffffffff, 0xffffffffffffffff};
    uint64_t value = odd[below(odd.size())];
    for (size_t width = size_t{1} << below(4); width > 0 && at < bytes.size(); --width, ++at) {
      bytes[at] = static_cast<char>(value);
      value >>= 8;
    }
  }

  static constexpr std::array<std::string_view, 14> numbers = {"0",
                                                               "-1",
                                                               "1e308",
                                                               "-1e-320",
                                                               "nan",
                                                               "inf",
                                                               "99999999999999999999",
                                                               "4294967296",
                                                               "2147483648",
                                                               "18446744073709551615",
                                                               "1e",
                                                               "0x10",
                                                               "3",
                                                               ""};
  static constexpr std::array<std::string_view, 12> words = {"\n",       " ",
                                                             "\t",       "{",
                                                             "]",        ":",
                                                             "- ",       "../../../../etc/passwd",
                                                             "%n%s",     std::string_view("\0", 1),
                                                             "\xff\xfe", "$(reboot)"};
  std::mt19937_64 random_;
};

}  // namespace repose::fuzz
