(define (problem a_tower_and_singles)
  (:domain blocksworld)
  (:objects red_block - block blue_block - block green_block - block yellow_block - block purple_block - block orange_block - block pink_block - block cyan_block - block)
  (:init
    (on blue_block red_block)
    (on green_block blue_block)
    (on purple_block yellow_block))
  (:goal (and))
)
