; Two towers of four are shuffled into one tower of eight.
(define (problem eight-blocks-interleave)
  (:domain blocksworld)
  (:objects
    blue_block cyan_block green_block orange_block pink_block purple_block red_block yellow_block - block
    arm - robot)
  (:init
    (handempty arm)
    (ontable red_block) (on orange_block red_block) (on yellow_block orange_block) (on green_block yellow_block) (clear green_block)
    (ontable cyan_block) (on blue_block cyan_block) (on purple_block blue_block) (on pink_block purple_block) (clear pink_block))
  (:goal (and
    (on cyan_block red_block)
    (on orange_block cyan_block)
    (on blue_block orange_block)
    (on yellow_block blue_block)
    (on purple_block yellow_block)
    (on green_block purple_block)
    (on pink_block green_block))))
