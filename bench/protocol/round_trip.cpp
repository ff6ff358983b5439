// Round trips of a request by the C++ client: a number on standard input asks for so many, back to back; their durations [ns]
// are one line on standard output.
#include <iostream>
#include <string>

#include "heptarm/heptarm.hpp"

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    heptarm::Options options;
    options.rate = 0;
    options.timeout = 60;
    options.watchdog = 5;
    heptarm::Arm arm(argv[1], options);
    arm.take_control();
    std::cout << "ready" << std::endl;
    long count;
    while (std::cin >> count) {
        std::string line;
        for (; count > 0; --count) {
            const std::int64_t begin = heptarm::now();
            arm.set_override(1.0);
            line += std::to_string(heptarm::now() - begin) + " ";
        }
        std::cout << line << std::endl;
    }
    return 0;
}
