// SPDX-License-Identifier: BSD-3-Clause
// Calls a fuzzer's entry point with random bytes, `--runs 1000 [--first 0]`, or with those of the
// files that are named: for compilers without libFuzzer, and to see a failure again.
#include "check.hpp"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <string_view>
#include <vector>

namespace {

void random_bytes(unsigned long long number) {
    std::mt19937_64 random(number);
    std::vector<std::uint8_t> bytes(random() % 256);
    for (auto& b : bytes)
        b = static_cast<std::uint8_t>(random());
    std::fprintf(stderr, "\r%llu", number); // the last one seen is the one that failed
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
}
void bytes_of(const char* path) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes(std::istreambuf_iterator<char>(file), {});
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

} // namespace

int main(int argc, char** argv) {
    const bool drawn = argc >= 3 && std::string_view(argv[1]) == "--runs";
    const unsigned long long runs = drawn ? std::strtoull(argv[2], nullptr, 10) : 0,
                             first = argc >= 5 ? std::strtoull(argv[4], nullptr, 10) : 0;
    for (unsigned long long k = first; k < first + runs; ++k)
        random_bytes(k);
    for (int k = 1; !drawn && k < argc; ++k)
        bytes_of(argv[k]);
}
