// Connect, move, and print the pose of the flange.
//
//     g++ -std=c++17 -O2 -pthread -I ../include -o first_motion first_motion.cpp
//     heptarm sim &                           # a virtual cabinet on port 30001
//     ./first_motion localhost:30001          # HEPTARM_KEY has the pre-shared key, if the cabinet has one

#include <cstdlib>
#include <iostream>

#include "heptarm/heptarm.hpp"

int main(int argc, char** argv) {
    using namespace heptarm;
    try {
        Options options;
        if (const char* key = std::getenv("HEPTARM_KEY")) options.key = key;
        Arm arm(argc > 1 ? argv[1] : "localhost:30001", options);
        std::cout << arm.welcome().robot.title << (arm.welcome().virtual_ ? " (virtual)" : "") << "\n";

        arm.take_control();
        arm.move(ptp({0, 0.52, 0, -1.57, 0, 1.05, 0}, 0.5));       // radians; half of each axis' full speed
        const Result result = arm.move(lin_rel({0, 0, -0.10}, "base", 0.2));  // 10 cm down at 0.2 m/s
        std::cout << wire::name(result.cause) << " after " << result.duration << " s\n";

        const wire::State state = arm.wait_for_rest();
        std::cout << "flange x " << state.pose->xyz[0] << " y " << state.pose->xyz[1] << " z " << state.pose->xyz[2] << " m\n";

        arm.move(ptp({0, 2.6, 0, 0, 0, 0, 0}));                    // beyond the limit of A2: refused, nothing moves
    } catch (const LimitError& error) {
        std::cout << "refused: " << error.what() << "\n";
    } catch (const Error& error) {
        std::cerr << error.what() << "\n";
        return 1;
    }
    return 0;
}
