// Swing the wrist with a stream of targets at 1 kHz that are computed while the arm moves.
//
//     g++ -std=c++17 -O2 -pthread -I ../include -o servo servo.cpp
//     ./servo localhost:30001

#include <cmath>
#include <cstdlib>
#include <iostream>

#include "heptarm/heptarm.hpp"

int main(int argc, char** argv) {
    using namespace heptarm;
    try {
        Options options;
        options.rate = 1000;  // states per second
        if (const char* key = std::getenv("HEPTARM_KEY")) options.key = key;
        Arm arm(argc > 1 ? argv[1] : "localhost:30001", options);
        arm.take_control();
        arm.move(ptp({0, 0.52, 0, -1.57, 0, 1.05, 0}, 0.5));

        ServoOptions settings;
        settings.rate = 1000;
        settings.velocity = 0.5;
        settings.acceleration = 1.0;
        Servo servo = arm.servo(settings);
        const Joints start = servo.start();
        while (servo.tick() && servo.t() < 3.0) {
            Joints q = start;
            q[6] += 0.3 * std::sin(2.0 * servo.t());
            servo.set(q);
        }
        servo.close();  // throws what ended it early, such as a missed watchdog
        if (const auto status = servo.status())
            std::cout << status->applied << " of " << status->targets << " targets followed, age " << 1e3 * status->age_median << " ms\n";
    } catch (const Error& error) {
        std::cerr << error.what() << "\n";
        return 1;
    }
    return 0;
}
