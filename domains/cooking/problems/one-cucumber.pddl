; A whole cucumber is sliced and ends in the bowl; one gripper has the knife already.
(define (problem one-cucumber)
  (:domain cooking)
  (:objects
    cucumber - veggie
    bowl - container
    chopping_knife - cuttool
    black_tray - location
    wooden_board - workspace
    robotic_gripper robotic_gripper2 - gripper)
  (:init
    (at cucumber black_tray) (is-whole cucumber) (available cucumber)
    (at bowl black_tray) (available bowl)
    (carry robotic_gripper2 chopping_knife) (free robotic_gripper))
  (:goal (and (is-sliced cucumber) (in cucumber bowl))))
