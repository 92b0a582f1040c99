; The knife must be fetched first, and is put back when the onion is sliced and in the bowl.
(define (problem knife-on-the-tray)
  (:domain cooking)
  (:objects
    onion - veggie
    bowl - container
    chopping_knife - cuttool
    black_tray - location
    wooden_board - workspace
    robotic_gripper robotic_gripper2 - gripper)
  (:init
    (at onion black_tray) (is-whole onion) (available onion)
    (at bowl black_tray) (available bowl)
    (at chopping_knife black_tray) (available chopping_knife)
    (free robotic_gripper) (free robotic_gripper2))
  (:goal (and (is-sliced onion) (in onion bowl) (at chopping_knife black_tray))))
